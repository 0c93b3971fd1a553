"""ragdoll_fit: any rigged, skinned character, or a robot's URDF, becomes a doll."""
from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Sequence
from pathlib import Path

from ..files.doll import save_doll
from ..files.scene import load_scene, save_scene
from ..files.urdf import to_urdf
from ..model import errors
from ..model.ragdoll import Ragdoll
from ..model.scene import Placement, all_above_ground
from .judging.verdict import Verdict, judge
from .pipeline import Fit, Options, fit_characters
from .reading.character import read_character
from .report import doll_report, fit_report
from .robots.robot import read_urdf

EXAMPLE = """\
example:
  ragdoll_fit character.glb -o doll.yaml --picture doll.png
  ros2 run ragdoll_ros ragdoll_node --ros-args -p scene:=doll.yaml

A .urdf becomes a doll too: a robot that goes limp. A .yaml of a doll, or
of a scene, is checked and reported.
Of several characters in one file each becomes a doll: DOLL.yaml is a scene of all, where they
stood; a DOLL.urdf and an OUT.png have _1, _2 and so on before their suffix.
The report ends with a verdict on the doll: good, doubtful or wrong.
Exit code 0: done; 2: a file or an option is wrong; 3: --strict, and the doll is not good."""

PICTURES = ('.png', '.jpg', '.svg', '.pdf')

DOLLS, ROBOTS = ('.yaml', '.yml'), ('.urdf', '.xml')
"""Files that hold bodies already; every other one is a character, for which they are made."""

FITTING = ('mass', 'masses', 'scale', 'shape', 'orientation', 'weight', 'smallest', 'keep')
"""Options that say how bodies are made."""


def main(arguments: list[str] | None = None) -> int:
    """Run the command; exit code 0, 2 where a file or an option is wrong, 3 as --strict says."""
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
        'ragdoll_fit', description=__doc__, epilog=EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('input', help='a .glb or .gltf with a skinned character, a .urdf, a .yaml')
    parser.add_argument('-o', '--output', metavar='DOLL.yaml', help='where the doll goes')
    parser.add_argument('--urdf', metavar='DOLL.urdf', help='write the doll as URDF too')
    parser.add_argument('--dialect', choices=('ros', 'bullet'), default='ros',
                        help='of that URDF: PyBullet has capsules, and takes links of no mass '
                        'as such only where they say so')
    parser.add_argument('--picture', metavar='OUT.png',
                        help='draw skin, bodies, joints and their ranges side by side')
    parser.add_argument('--mass', type=float, metavar='KG',
                        help='of each whole doll (default: as much water as the skin holds)')
    parser.add_argument('--masses', choices=('best', 'volume', 'proportions'), default='best',
                        help="share the mass by the skin's volume, by a person's proportions, or "
                        'by volume and for a person half way between (default)')
    parser.add_argument('--scale', type=float, metavar='M',
                        help='metres to one unit of the file (default: 1, or a guess)')
    parser.add_argument('--shape', default='best',
                        choices=('best', 'box', 'sphere', 'capsule', 'cylinder'),
                        help='shape of all bodies (default: the smallest that fits, each)')
    parser.add_argument('--orientation', choices=('principal', 'bone'), default='principal',
                        help="z along a body's longest extent, or along its bone")
    parser.add_argument('--weight', type=float, metavar='SHARE',
                        help='a vertex counts for every bone that moves it by this share or more '
                        '(default: for the one that moves it most)')
    parser.add_argument('--smallest', type=float, metavar='M',
                        help='bones with less skin than this are merged into their parents '
                        '(default: 0.055 of the character; 0: none, fingers stay too)')
    parser.add_argument('--keep', nargs='+', action='extend', default=[], metavar='BONE',
                        help="bones that become bodies whatever their size: names as in the "
                        "report, or patterns such as '*Thumb*'")
    parser.add_argument('--strict', action='store_true',
                        help='exit with 3 where the verdict is not good')
    return parser


def _run(options: argparse.Namespace) -> list[Verdict]:
    path = Path(options.input)
    made = _made(options, path)
    verdicts = [judge(each.doll, fit, measured=path.suffix.lower() in ROBOTS)
                for each, fit, _ in made]
    report = '\n\n'.join(f'{text}\n{verdict}'
                         for (_, _, text), verdict in zip(made, verdicts, strict=True))
    print(report)
    head = f'Fitted to {path.name}\n\n{report}'
    if options.output and len(made) == 1:
        save_doll(made[0][0].doll, options.output, head)
    elif options.output:
        scene = all_above_ground(Path(options.output).stem, [placement for placement, _, _ in made])
        save_scene(scene, options.output, head)
    for number, (placement, fit, _) in enumerate(made, 1):
        ending = f'_{number}' if len(made) > 1 else ''
        if options.urdf:
            _ended(options.urdf, ending).write_text(to_urdf(placement.doll, options.dialect),
                                                    encoding='utf-8')
        if options.picture:
            from .picture import draw
            draw(placement.doll, fit.character if fit else None, _ended(options.picture, ending))
    return verdicts


def _made(options: argparse.Namespace, path: Path) -> list[tuple[Placement, Fit | None, str]]:
    """Each doll in its place, how it was fitted where it was, and the report on it."""
    if path.suffix.lower() in DOLLS:
        return _loaded(options)
    if path.suffix.lower() in ROBOTS:
        doll, notes = read_urdf(path)
        return [(Placement(doll), None, doll_report(doll, notes))]
    fits = fit_characters(read_character(path, options.scale), Options(
        options.shape, options.orientation, options.weight, options.smallest, options.mass,
        options.masses, tuple(options.keep)))
    heads = _heads([fit.doll for fit in fits], 'character')
    return [(fit.placed(model=str(path)), fit, head + fit_report(fit))
            for fit, head in zip(fits, heads, strict=True)]


def _loaded(options: argparse.Namespace) -> list[tuple[Placement, None, str]]:
    """The doll in a YAML file, or each that differs of a scene, as _made gives them."""
    dolls = list({id(each.doll): each.doll for each in load_scene(options.input).dolls}.values())
    if options.output and len(dolls) > 1:
        raise errors.WrongForm('--output', options.output,
                               f'one doll to write, and {options.input} holds {len(dolls)}')
    heads = _heads(dolls, 'doll')
    return [(Placement(doll), None, head + doll_report(doll))
            for doll, head in zip(dolls, heads, strict=True)]


def _heads(dolls: Sequence[Ragdoll], kind: str) -> list[str]:
    """Heads of their reports, where there is more than one."""
    return [f'{doll.name}, {kind} {number} of {len(dolls)}:\n' if len(dolls) > 1 else ''
            for number, doll in enumerate(dolls, 1)]


def _ended(path: str, ending: str) -> Path:
    """The path with an ending before its suffix."""
    return Path(path).with_stem(Path(path).stem + ending)


def _check(options: argparse.Namespace, parser: argparse.ArgumentParser) -> None:
    suffix = Path(options.input).suffix.lower()
    for key in FITTING if suffix in (*DOLLS, *ROBOTS) else ():
        if getattr(options, key) != parser.get_default(key):
            raise errors.WrongForm(f'--{key}', getattr(options, key),
                                   f'a .glb or .gltf to fit: what a {suffix} says of bodies stays')
    for key in ('mass', 'scale'):
        if getattr(options, key) is not None:
            errors.check_positive(f'--{key}', getattr(options, key))
    if options.smallest is not None:
        errors.check_range('--smallest', options.smallest, 0, math.inf)
    if options.weight is not None:
        errors.check_range('--weight', options.weight, 0, 1)
    if options.picture and Path(options.picture).suffix.lower() not in PICTURES:
        raise errors.WrongForm('--picture', options.picture,
                               'a name that ends in ' + ', '.join(PICTURES))


def _one_line(error: errors.RagdollError) -> str:
    if isinstance(error, errors.ModelErrors) and len(error.errors) == 1:
        return f'{error.file}: {error.errors[0]}'
    return str(error)


if __name__ == '__main__':
    sys.exit(main())
