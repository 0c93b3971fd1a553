"""Unilateral contacts with Coulomb friction in a plane, solved by enumeration of contact modes.

Contact i gives a normal and a tangential force, or impulse, (n_i, t_i), and has a normal and a
tangential response

    w = G (n, t) + b,

G the Delassus matrix, w accelerations or velocities after an impact. A contact is open (no force,
w_n >= 0) or closed (w_n = 0, n >= 0). A closed contact sticks (w_t = 0, |t| <= mu n) or slides in
the direction s (t = -s mu n, s w_t >= 0). Moreau's law: sliding is determined by the velocity
afterwards.
"""
import itertools
from collections.abc import Sequence

import numpy as np

OPEN, STICK, FORWARD, BACKWARD = 'open', 'stick', 'forward', 'backward'
SIGNS = {FORWARD: 1.0, BACKWARD: -1.0}
MODES = (OPEN, STICK, FORWARD, BACKWARD)

TOLERANCE = 1e-9
"""Tolerance of inequalities relative to the largest term of b: rounding."""


def rows_and_forces(jacobian: np.ndarray, modes: Sequence[str],
                    friction: float) -> tuple[np.ndarray, np.ndarray]:
    """Constraint rows (r, nv) of the modes, and the directions (r, nv) of their forces.

    ``jacobian`` (k, 2, nv) has each contact's normal and tangential row.
    """
    rows, forces = [], []
    for (normal, tangent), mode in zip(jacobian, modes, strict=True):
        if mode == OPEN:
            continue
        rows.append(normal)
        forces.append(normal - SIGNS.get(mode, 0.0) * (friction if mode != STICK else 0) * tangent)
        if mode == STICK:
            rows.append(tangent)
            forces.append(tangent)
    shape = (len(rows), jacobian.shape[-1])
    return np.reshape(rows, shape), np.reshape(forces, shape)


def contact_forces(multipliers: np.ndarray, modes: Sequence[str], friction: float) -> np.ndarray:
    """Normal and tangential forces (k, 2) of all contacts from the multipliers (r,)."""
    found, left = np.zeros((len(modes), 2)), iter(multipliers)
    for force, mode in zip(found, modes, strict=True):
        if mode != OPEN:
            force[0] = next(left)
            force[1] = next(left) if mode == STICK else -SIGNS[mode] * friction * force[0]
    return found


def constrained_motion(mass: np.ndarray, force: np.ndarray, jacobian: np.ndarray, drift: np.ndarray,
                       modes: Sequence[str], friction: float) -> tuple[np.ndarray, np.ndarray]:
    """Accelerations (nv,) with fixed modes, and forces (k, 2) of all contacts.

    ``force`` (nv,): generalized; ``drift`` (k, 2): accelerations of the contacts where the
    generalized ones are zero.
    """
    rows, forces = rows_and_forces(jacobian, modes, friction)
    held = rows_and_forces(drift[..., None], modes, friction)[0][:, 0]
    free, mobile = np.linalg.solve(mass, force), np.linalg.solve(mass, forces.T)
    multipliers = np.linalg.lstsq(rows @ mobile, -held - rows @ free, rcond=1e-12)[0]
    return free + mobile @ multipliers, contact_forces(multipliers, modes, friction)


def choices(friction: float) -> tuple[str, ...]:
    """Possible modes of a contact that does not slide yet; without friction open or one sliding
    mode.
    """
    return MODES if friction > 0 else (OPEN, FORWARD)


def solve(mass: np.ndarray, jacobian: np.ndarray, free: np.ndarray, friction: float,
          options: Sequence[Sequence[str]], slides: np.ndarray | None = None,
          ) -> tuple[tuple[str, ...], np.ndarray]:
    """Modes (k,) and forces (k, 2) that satisfy all laws, by trying the contacts' ``options``.

    ``mass`` (nv, nv), ``jacobian`` (k, 2, nv), ``free`` (k, 2): b, each contact's w without forces;
    ``slides`` (k,): contacts that slide already, whatever their acceleration. Indeterminate forces,
    as of a rod that sticks at both ends, are those of least norm.
    """
    slides = np.zeros(len(free), bool) if slides is None else slides
    mobile = np.linalg.solve(mass, jacobian.reshape(-1, len(mass)).T)
    missed = {}
    for modes in itertools.product(*options):
        rows, forces = rows_and_forces(jacobian, modes, friction)
        held = rows_and_forces(free[..., None], modes, friction)[0][:, 0]
        multipliers = np.linalg.lstsq(rows @ np.linalg.solve(mass, forces.T), -held, rcond=1e-12)[0]
        found = contact_forces(multipliers, modes, friction)
        response = free + (jacobian.reshape(-1, len(mass)) @ (mobile @ found.ravel())).reshape(
            free.shape)
        wrong = violation(modes, found, response, friction, slides)
        if wrong <= TOLERANCE * max(1.0, float(np.abs(free).max())):
            return modes, found
        missed[modes] = wrong
    raise ArithmeticError(f'no mode of {len(free)} contacts fits: {min(missed.values()):.1e}')


def violation(modes: Sequence[str], forces: np.ndarray, response: np.ndarray,
              friction: float, slides: np.ndarray) -> float:
    """Largest violation of a law; 0 if all hold."""
    worst = 0.0
    for mode, (normal, tangent), (away, along), slid in zip(modes, forces, response, slides,
                                                            strict=True):
        if mode == OPEN:
            worst = max(worst, -away)
            continue
        worst = max(worst, -normal, abs(away))
        if mode == STICK:
            worst = max(worst, abs(tangent) - friction * normal, abs(along))
        elif friction > 0 and not slid:
            worst = max(worst, -SIGNS[mode] * along)
    return worst
