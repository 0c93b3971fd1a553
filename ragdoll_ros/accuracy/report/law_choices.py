"""Text of the page: questions that the mechanics of rigid bodies leaves open."""

LAW_CHOICES = """\
## Where the law itself is a choice

The mechanics of rigid bodies leaves some questions open. Engines answer them differently, and \
smaller steps do not make them agree. On these points the reference of this page, our own engine \
at small steps, is one answer and not the truth:

- **Restitution.** For one contact without friction all laws agree. With several contacts, joints \
or friction they do not: Newton's law sets speeds of separation, Poisson's sets impulses, \
Stronge's sets energies. Ours is Newton's, for all contacts of an impact at once, reduced where it \
would create energy. MuJoCo's contacts are springs with dampers, whose impacts last some steps: \
what the contacts return then depends on all that happens meanwhile. Without restitution most of \
these differences vanish, so drops are compared at e = 0 as well. There are also thresholds of \
speed below which nothing bounces.
- **Simultaneous impacts.** In which order touching bodies transmit a blow is not determined, as \
in a row of balls. Ours solves what touches at one instant as one impact, and what touches later \
as another. With fixed steps, all impacts within a step are one.
- **Joint limits.** Ours are rigid and do not bounce. Those of MuJoCo are springs with dampers; a \
joint passes them, and comes back later and with other velocities than from a rigid limit. \
PyBullet passes them as well, and corrects them over several steps. A body's own limits are soft, \
in a way that no engine here represents.
- **Friction.** Coulomb's law is that of a point: a cone in ours and PyBullet, a pyramid in DART, \
a smooth approximation in MuJoCo and Drake, which creep where others stick. Both solve a \
convex problem, in which what slides is also thrust off, the more the higher the friction \
(Anitescu 2006). In MuJoCo's finest steps a forearm that slides at 0.2 m/s with µ = 0.7 \
touches the ground in one step of a hundred, and after 0.1 s it is 3 mm from where Coulomb's law \
has it, 1.3 mm of that upwards; with µ = 0.2 a tenth of that, and without friction nothing. \
The mechanics of rigid bodies does not determine the pressure under a face nor, with that, how \
sliding and spinning reduce each other's friction. Ours is that of an affine pressure over the \
whole face, while a face slips; the other engines support a face by a few points of their own \
choice. The short segments show what this amounts to: without restitution and friction the \
engines come together as steps get finer; with friction each comes to an end of its own."""
