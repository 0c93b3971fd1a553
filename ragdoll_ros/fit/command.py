"""Fit a ragdoll to a rigged, skinned character, or convert a robot's URDF or SDF to a ragdoll."""
import argparse
import math
import sys
from collections.abc import Sequence
from pathlib import Path

from ..files.doll import save_doll
from ..files.scene import MOST_DOLLS, load_scene, save_scene
from ..files.urdf import to_urdf
from ..model import errors
from ..model.ragdoll import Ragdoll
from ..model.scene import Placement, Scene, all_above_ground
from .judging.fall_cost import costs_report, measure_costs
from .judging.verdict import Verdict, judge
from .pipeline import Fit, FitOptions, fit_characters
from .reading.character import read_character
from .report import animations_report, captures_report, doll_report, fit_report
from .robots.robot import read_urdf
from .robots.sdf_dolls import read_sdf
from .skeleton.skin_tree import TREES

EPILOG = """\
example:
  ragdoll_fit character.glb -o doll.yaml --picture doll.png
  ros2 run ragdoll_ros ragdoll_node --ros-args -p scene:=doll.yaml

A .urdf or .sdf becomes a doll too: the robot with its motors off; so does a .xacro, where xacro is
installed. A .yaml with a doll or a scene is checked and reported.
If the file has several characters or robots, each becomes a doll: DOLL.yaml is a scene with all of
them in place; DOLL.urdf and OUT.png get _1, _2, ... before the suffix.
The report ends with a verdict on the doll: good, doubtful or wrong.
Exit code 0: success; 2: invalid file or option; 3: --strict, and the doll is not good."""

PICTURE_SUFFIXES = ('.png', '.jpg', '.svg', '.pdf')

DOLL_SUFFIXES, SDF_SUFFIXES = ('.yaml', '.yml'), ('.sdf', '.world')
ROBOT_SUFFIXES = ('.urdf', '.xml', '.xacro', *SDF_SUFFIXES)
"""Files that define bodies; for all other files, characters, bodies are fitted."""

FIT_ARGUMENTS = ('mass', 'masses', 'scale', 'shape', 'orientation', 'weight', 'smallest', 'keep',
                 'tree', 'root')
"""Options that apply to fitted bodies only."""


def main(arguments: list[str] | None = None) -> int:
    """Run the command; returns 0, 2 for an invalid file or option, 3 as --strict specifies."""
    parser = _parser()
    options = parser.parse_args(arguments)
    try:
        _check(options, parser)
        verdicts = _run(options)
    except errors.RagdollError as error:
        print(f'ragdoll_fit: {_one_line(error)}', file=sys.stderr)
        return 2
    except OSError as error:
        print(f'ragdoll_fit: {error.filename}: {error.strerror}', file=sys.stderr)
        return 2
    return 3 if options.strict and any(each.word != 'good' for each in verdicts) else 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        'ragdoll_fit', description=__doc__, epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('input', help='a .glb, .gltf or .vrm with a skinned character; the '
                        '.urdf, .xacro or .sdf of a robot; or the .yaml of a doll or scene, which '
                        'is only checked')
    parser.add_argument('-o', '--output', metavar='DOLL.yaml', help='write the doll to this file')
    parser.add_argument('--urdf', metavar='DOLL.urdf', help='write the doll as URDF too')
    parser.add_argument('--dialect', choices=('ros', 'bullet'), default='ros',
                        help='dialect of that URDF (default: ros); bullet: with <capsule>, and '
                        'with links without mass marked as PyBullet requires')
    parser.add_argument('--picture', metavar='OUT.png',
                        help='draw skin, bodies, joints and joint ranges side by side')
    parser.add_argument('--mass', type=float, metavar='KG',
                        help="mass of each doll (default: the skin's volume of water)")
    parser.add_argument('--masses', choices=('best', 'volume', 'proportions'), default='best',
                        help="how to distribute the mass: by the skin's volume; by a person's "
                        'proportions; or (best, the default) by volume and, for a person, by the '
                        'geometric mean of both')
    parser.add_argument('--scale', type=float, metavar='M',
                        help='metres per unit of the file (default: 1, or an estimate)')
    parser.add_argument('--shape', default='best',
                        choices=('best', 'box', 'sphere', 'capsule', 'cylinder'),
                        help='shape of all bodies (default: for each the smallest that fits)')
    parser.add_argument('--orientation', choices=('principal', 'bone'), default='principal',
                        help="z along a body's longest axis, or along its bone")
    parser.add_argument('--weight', type=float, metavar='SHARE',
                        help='a vertex belongs to every bone with at least this skin weight '
                        '(default: to the bone with the largest weight)')
    parser.add_argument('--smallest', type=float, metavar='M',
                        help='merge bones with a smaller skin into their parents (default: 0.055 '
                        "of the character's extent; 0: merge none, keep fingers)")
    parser.add_argument('--keep', nargs='+', action='extend', default=[], metavar='BONE',
                        help='bones that become bodies whatever their size: names as in the '
                        "report, or patterns such as '*Thumb*'")
    parser.add_argument('--animation', nargs='+', action='extend', default=[], metavar='MOVE.bvh',
                        help='motion capture by which a scene can move the doll: also report how '
                        'well the doll can follow it')
    parser.add_argument('--tree', choices=TREES, default='auto',
                        help="tree of bones: the file's where a joint lies in or near both bodies, "
                        "else the skin's (auto, the default); all of the file's; or the skin's "
                        'alone')
    parser.add_argument('--root', metavar='BONE',
                        help='the bone that becomes the root (default: found in the trunk)')
    parser.add_argument('--strict', action='store_true',
                        help='exit with code 3 unless the verdict is good')
    return parser


def _run(options: argparse.Namespace) -> list[Verdict]:
    path = Path(options.input)
    made = _make_dolls(options, path)
    if len(made) > MOST_DOLLS:
        raise errors.OutOfRange(str(path), len(made), f'at most {MOST_DOLLS} dolls in a file')
    made = [(each, fit, '\n'.join([text, *captures_report(each.doll, options.animation)]))
            for each, fit, text in made]
    verdicts = [judge(each.doll, fit, measured=path.suffix.lower() in ROBOT_SUFFIXES)
                for each, fit, _ in made]
    scene = _scene(options, [placement for placement, _, _ in made])
    cost = costs_report(measure_costs(scene))
    report = '\n\n'.join('\n'.join([text, *(cost if len(made) == 1 else ()), str(verdict)])
                         for (_, _, text), verdict in zip(made, verdicts, strict=True))
    if len(made) > 1:
        report = '\n'.join([*cost, '', report]) if cost else report
    print(report)
    head = f'Fitted to {path.name}\n\n{report}'
    if options.output and len(made) == 1:
        save_doll(made[0][0].doll, options.output, head)
    elif options.output:
        save_scene(scene, options.output, head)
    if options.output:
        load_scene(options.output)  # raises what whoever loads it would read
    for number, (placement, fit, _) in enumerate(made, 1):
        ending = f'_{number}' if len(made) > 1 else ''
        if options.urdf:
            _numbered(options.urdf, ending).write_text(to_urdf(placement.doll, options.dialect),
                                                       encoding='utf-8')
        if options.picture:
            from .picture import draw
            draw(placement.doll, fit.character if fit else None, _numbered(options.picture, ending))
    return verdicts


def _scene(options: argparse.Namespace, placements: list[Placement]) -> Scene:
    """Scene with the dolls above the ground; a scene file with several dolls is returned
    as it is.
    """
    if Path(options.input).suffix.lower() in DOLL_SUFFIXES and len(placements) > 1:
        return load_scene(options.input)
    return all_above_ground(Path(options.output or options.input).stem, placements)


def _make_dolls(options: argparse.Namespace, path: Path) -> list[tuple[Placement, Fit | None, str]]:
    """Each doll with its placement, its fit if it was fitted, and its report."""
    if path.suffix.lower() in DOLL_SUFFIXES:
        return _load_dolls(options)
    if path.suffix.lower() in SDF_SUFFIXES:
        robots = read_sdf(path)
        heads = _headings([placement.doll for placement, _ in robots], 'robot')
        return [(placement, None, head + doll_report(placement.doll, notes))
                for (placement, notes), head in zip(robots, heads, strict=True)]
    if path.suffix.lower() in ROBOT_SUFFIXES:
        doll, notes = read_urdf(path)
        return [(Placement(doll), None, doll_report(doll, notes))]
    fits = fit_characters(read_character(path, options.scale), FitOptions(
        options.shape, options.orientation, options.weight, options.smallest, options.mass,
        options.masses, tuple(options.keep), options.tree, options.root))
    heads = _headings([fit.doll for fit in fits], 'character')
    dolls = [fit.placed(model=str(path)) for fit in fits]
    return [(doll, fit, head + '\n'.join([fit_report(fit), *animations_report(doll.doll)]))
            for doll, fit, head in zip(dolls, fits, heads, strict=True)]


def _load_dolls(options: argparse.Namespace) -> list[tuple[Placement, None, str]]:
    """The distinct dolls of a YAML file, a doll or a scene, as _make_dolls returns them."""
    dolls = list({id(each.doll): each.doll for each in load_scene(options.input).dolls}.values())
    if options.output and len(dolls) > 1:
        raise errors.WrongForm('--output', options.output,
                               f'one doll to write, and {options.input} holds {len(dolls)}')
    heads = _headings(dolls, 'doll')
    return [(Placement(doll), None, head + doll_report(doll))
            for doll, head in zip(dolls, heads, strict=True)]


def _headings(dolls: Sequence[Ragdoll], kind: str) -> list[str]:
    """Headings of the reports, empty for a single doll."""
    return [f'{doll.name}, {kind} {number} of {len(dolls)}:\n' if len(dolls) > 1 else ''
            for number, doll in enumerate(dolls, 1)]


def _numbered(path: str, ending: str) -> Path:
    """The path with ``ending`` before its suffix."""
    return Path(path).with_stem(Path(path).stem + ending)


def _check(options: argparse.Namespace, parser: argparse.ArgumentParser) -> None:
    suffix = Path(options.input).suffix.lower()
    for key in FIT_ARGUMENTS if suffix in (*DOLL_SUFFIXES, *ROBOT_SUFFIXES) else ():
        if getattr(options, key) != parser.get_default(key):
            raise errors.WrongForm(f'--{key}', getattr(options, key),
                                   f'a .glb or .gltf to fit: a {suffix} defines its own bodies')
    for key in ('mass', 'scale'):
        if getattr(options, key) is not None:
            errors.check_positive(f'--{key}', getattr(options, key))
    if options.smallest is not None:
        errors.check_range('--smallest', options.smallest, 0, math.inf)
    if options.weight is not None:
        errors.check_range('--weight', options.weight, 0, 1)
    if options.picture and Path(options.picture).suffix.lower() not in PICTURE_SUFFIXES:
        raise errors.WrongForm('--picture', options.picture,
                               'a name that ends in ' + ', '.join(PICTURE_SUFFIXES))


def _one_line(error: errors.RagdollError) -> str:
    if isinstance(error, errors.ModelErrors) and len(error.errors) == 1:
        return f'{error.file}: {error.errors[0]}'
    return str(error)


if __name__ == '__main__':
    sys.exit(main())
