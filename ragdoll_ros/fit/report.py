"""Report on a fit: bodies, quality and warnings, for the terminal and the head of the doll's file.

See judging/verdict.py for the verdict.
"""
import textwrap
from collections.abc import Sequence

import numpy as np

from ..files.animation import Animation, load_animations
from ..model.compound import Compound
from ..model.errors import ModelError, RagdollError
from ..model.ragdoll import Ragdoll
from ..model.shapes import Shape
from .bodies.overlap import colliding_overlaps, covered, overlap_share
from .judging.plausibility import extent
from .pipeline import BodyFit, Fit
from .shapes.fitting import TOLERANCE

COMPARED_INSTANTS, COMPARED_ANIMATIONS = 8, 20
"""Instants of each of the first animations at which the doll is compared: some 20 ms each."""


def fit_report(fit: Fit) -> str:
    """Table of the bodies, totals, and warnings."""
    bones, character = fit.doll.bones, fit.character
    inside = covered(bones, character.vertices, TOLERANCE)
    volume, skin = sum(bone.shape.volume for bone in bones), character.volume()
    return '\n'.join([
        *_table(fit.doll, 'vertices inside  axis  ', [_quality(body) for body in fit.bodies]), '',
        f'{len(bones)} bodies for {len(character.bone_names)} bones, {fit.doll.mass:.4g} kg, '
        f'{extent(fit.doll):.3g} m; one unit of the file is {character.scale:g} m',
        f'{100 * inside.mean():.1f} % of {len(inside)} vertices inside a body or within 1 cm; '
        f'volume {1000 * volume:.4g} l' + (
            f", {volume / skin:.2f} of the skin's" if skin > 0 else '')
        + f', {100 * overlap_share(bones):.0f} % of it shared',
        *_swings(fit.doll), *_overlaps(fit.doll), *_warnings(fit.notes)])


def doll_report(doll: Ragdoll, notes: tuple[str, ...] = ()) -> str:
    """The report on a doll that was not fitted here; ``notes`` become warnings."""
    return '\n'.join([
        *_table(doll, '', [''] * len(doll.bones)), '',
        f'{len(doll.bones)} bodies, {doll.mass:.4g} kg, {extent(doll):.3g} m',
        *_overlaps(doll), *_warnings(notes)])


def animations_report(doll: Ragdoll) -> list[str]:
    """A line for each of a file's first animations: how well the fitted doll can follow it.

    Further lines name the animations beyond COMPARED_ANIMATIONS.
    """
    try:
        animations = list(load_animations(doll).values())
    except RagdollError as error:
        return _warnings((f'no animations: {" ".join(str(error).split())}',))
    rest = ', '.join(each.name for each in animations[COMPARED_ANIMATIONS:])
    return [*map(_animation, animations[:COMPARED_ANIMATIONS]), *textwrap.wrap(
        f'animations that were not compared: {rest}' if rest else '', 97,
        subsequent_indent='  ', break_long_words=False)]


def captures_report(doll: Ragdoll, files: Sequence[str]) -> list[str]:
    """A line for each file of motion capture: how well the doll can follow it.

    Raises ModelErrors or a ModelError for a file that is broken or does not fit.
    """
    lines = []
    for file in files:
        try:
            lines += map(_followed, load_animations(doll, file).values())
        except ModelError as error:
            raise error.at(f'--animation {file}') from None
    return lines


def _animation(animation: Animation) -> str:
    try:
        return _followed(animation)
    except RagdollError as error:
        return f'warning: animation {animation.name}: {error}'


def _followed(animation: Animation) -> str:
    motions = [animation.at(time)
               for time in np.linspace(0, animation.duration, COMPARED_INSTANTS).tolist()]
    distance, bone = max((distance, bone) for motion in motions
                         for bone, distance in motion.distances.items())
    clipped = sorted({name for motion in motions for name in motion.clipped})
    far = f'{1000 * distance:.0f} mm ({bone})' if distance > 0.001 else '1 mm'
    limits = f'; beyond their limits: {", ".join(clipped)}' if clipped else ''
    return (f'animation {animation.name}: {animation.duration:.3g} s; '
            f'followed to within {far}{limits}')


def _table(doll: Ragdoll, title: str, columns: list[str]) -> list[str]:
    """Header and a row for each body; ``columns`` follow the name."""
    width = max(4, *(len(bone.name) for bone in doll.bones))
    joints = {joint.child: joint.kind for joint in doll.joints}
    return [f'{"bone":{width}}  {title}{"shape":8} {"size, m":23} {"mass, kg":>9}  joint',
            *(f'{bone.name:{width}}  {column}{bone.shape.kind:8} {_size(bone.shape):23} '
              f'{bone.mass:9.4g}  {joints.get(bone.name, "root")}'
              for bone, column in zip(doll.bones, columns, strict=True))]


def _quality(body: BodyFit) -> str:
    share = f'{100 * body.inside / body.vertices:5.1f}%' if body.vertices else '     -'
    # An asterisk: z is the principal axis instead of the bone's direction.
    return (f'{body.vertices:8d} {share} {body.axes.elongation:.2f}'
            f'{"*" if body.axes.principal else " "}  ')


def _size(shape: Shape | Compound) -> str:
    if isinstance(shape, Compound):
        return f'{len(shape.parts)} shapes'
    edges = [edge for value in vars(shape).values()
             for edge in (value if isinstance(value, tuple) else (value,))]
    return ' x '.join(f'{edge:.4f}' for edge in edges)


def _swings(doll: Ragdoll) -> list[str]:
    count, links = len(doll.swings), sum(len(swing.links) for swing in doll.swings)
    return [f'spring bones that became swings: {count}, with {links} links; no body covers '
            'their skin'] if count else []


def _overlaps(doll: Ragdoll) -> list[str]:
    pairs = [*doll.no_collision, *colliding_overlaps(doll)]
    if not pairs:
        return []
    listed = ', '.join(f'{first} and {second}' for first, second in pairs)
    return textwrap.wrap(f'overlap in the bind pose, excluded from collision: {listed}', 97,
                         subsequent_indent='  ', break_long_words=False)


def _warnings(sentences: tuple[str, ...]) -> list[str]:
    return [f'warning: {sentence}' for sentence in sentences]
