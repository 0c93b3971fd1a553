"""ragdoll_person: the doll of a person of a given height, mass and sex."""
import argparse
import sys
from pathlib import Path

from ..files.doll import save_doll
from ..model import errors
from ..model.anthropometry import PERCENTILES, SEXES
from ..model.ragdoll import Ragdoll
from .person import person, standard

EXAMPLE = """\
examples:
  ragdoll_person --height 1.62 --mass 67 --sex female -o person.yaml
  ragdoll_person --sex male --percentile 95 -o large.yaml
  ragdoll_person --sex female --passive -o soft_joints.yaml
  ros2 run ragdoll_ros ragdoll_node --ros-args -p scene:=person.yaml

Masses, centres of mass and inertias are those of de Leva 1996 (J Biomech 29:1223), the percentiles
those of ANSUR II.
Exit code 0: done; 2: an option is wrong, or the file cannot be written."""

HEAD = """\
A person as a doll: {sex}, {height:g} m, {mass:g} kg; soles on z = 0.
Written by: ragdoll_person --height {height:g} --mass {mass:g} --sex {sex}{passive}
Masses, centres of mass and inertias: de Leva 1996. Shapes: lengths, and girths of ANSUR II."""


def main(arguments: list[str] | None = None) -> int:
    """Run the command; exit code 2 if an option is wrong or the file cannot be written."""
    options = _parser().parse_args(arguments)
    try:
        average = standard(options.sex, options.percentile)
        height = average[0] if options.height is None else options.height
        mass = average[1] if options.mass is None else options.mass
        doll = person(height, mass, options.sex, Path(options.output).stem, options.passive)
        save_doll(doll, options.output, HEAD.format(
            sex=options.sex, height=height, mass=mass, passive=' --passive' * options.passive))
    except errors.RagdollError as error:
        print(f'ragdoll_person: --{error}', file=sys.stderr)
        return 2
    except OSError as error:
        print(f'ragdoll_person: {error.filename}: {error.strerror}', file=sys.stderr)
        return 2
    print(f'{doll}, {height:g} m tall, {options.sex}')
    print(_table(doll))
    if options.passive:
        print(f'passive torques: {_angles(doll, True)}')
        print(f'none known, hard limits: {_angles(doll, False)}')
    print(f'written to {options.output}')
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        'ragdoll_person', description=__doc__, epilog=EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--sex', choices=SEXES, required=True,
                        help='sex, which selects the anthropometric table')
    parser.add_argument('--height', type=float, metavar='M',
                        help="standing height, m, 1.0 to 2.1 (default: the percentile's)")
    parser.add_argument('--mass', type=float, metavar='KG',
                        help="kg, 15 to 160 (default: the percentile's)")
    parser.add_argument('--percentile', type=int, choices=PERCENTILES['male'], default=50,
                        help='percentile of US soldiers for height and mass if not given '
                             '(default 50)')
    parser.add_argument('--passive', action='store_true',
                        help='elastic torques of tissue at hips, knees, ankles and trunk in place '
                             'of hard limits; only the engine rigid has them')
    parser.add_argument('-o', '--output', metavar='DOLL.yaml', default='person.yaml',
                        help='output file (default person.yaml)')
    return parser


def _angles(doll: Ragdoll, passive: bool) -> str:
    """Names of the angles of joints with passive torques, or of those without; left limbs only."""
    return ', '.join(name for joint in doll.joints if not joint.child.startswith('right_')
                     and bool(joint.passive) == passive for name in joint.angle_names)


def _table(doll: Ragdoll) -> str:
    """Table of the mass, centre and inertia of each bone; of the limbs, only the left ones."""
    lines = [f'{"bone":16} {"kg":>7} {"centre x, z, m":>16} {"Ixx, Iyy, Izz, kg m^2":>30}']
    for bone in doll.bones:
        if not bone.name.startswith('right_'):
            x, _, z = bone.position
            moments = ' '.join(f'{moment:9.5f}' for moment in bone.moments)
            lines.append(f'{bone.name:16} {bone.mass:7.3f} {x:8.3f}{z:8.3f} {moments:>30}')
    return '\n'.join(lines)


if __name__ == '__main__':
    sys.exit(main())
