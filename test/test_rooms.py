"""The rooms of the package and the arrows between them, read from the code's own imports.

An arrow that is not drawn here is an error of the code, not of the test: see docs/architecture.md.
"""
import ast
import sys
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parent.parent / 'ragdoll_ros'
ARROWS = {
    'model': set(),
    'files': {'model'},
    'physics': {'files', 'model'},
    'realtime': {'model'},
    'people': {'files', 'model'},
    'fit': {'physics', 'files', 'model'},
    'ros': {'realtime', 'physics', 'files', 'model'},
    'recordings': {'physics', 'files', 'model'},
    'viewer': {'realtime', 'physics', 'fit', 'recordings', 'files', 'model'},
    'replay': {'physics', 'fit', 'recordings', 'files', 'model'},
    'accuracy': {'physics', 'people', 'files', 'model'},
    'falls': {'physics', 'people', 'files', 'model'}}
"""What a room may import of others."""

TIED = {'ros': ('viewer.sources.node', 'replay.published'),
        'fit': ('ros.simulation_interfaces.resources.dolls',)}
"""Modules that may import a room that theirs may not."""

ONLY = {'pybullet': 'physics/engine/substepped/bullet.py',
        'mujoco': 'physics/engine/substepped/mujoco.py',
        'numba': 'physics/kernels/', 'viser': 'viewer/',
        'matplotlib': ('fit/', 'accuracy/', 'falls/pictures.py'),
        'trimesh': 'files/robots/mesh_file.py', 'vhacdx': 'files/robots/hull_decomposition.py',
        'DracoPy': 'fit/reading/draco.py',
        'pyarrow': 'falls/formats/', 'ray': 'falls/cluster.py', 'mcap_ros2': 'falls/formats/',
        'scipy': 'accuracy/', 'dartpy': 'accuracy/peers/dart.py',
        'pydrake': 'accuracy/peers/drake.py',
        'mcap': ('files/bags/bag.py', 'recordings/mcap_file.py')}
"""Libraries, and the one place of each. The report's pendulum in three lines of PyBullet alone is
what a user would write without this package: it shares no code with it."""

FLOORS = {
    'physics.kernels': ('compiling', 'maths', 'contact_kind', 'dynamics', 'system',
                        'cluster_state', 'collision', 'workspace', 'contact', 'impulses',
                        'stepping', 'flight', 'swing', 'links', 'advance', 'loaded', '__main__'),
    'fit': ('roles', 'shapes', 'reading', 'skeleton', 'bodies', 'joints', 'robots', 'skin',
            'pipeline', 'judging', 'report', 'picture', 'command')}
"""Of a room: each stands on those before it."""

Edges = list[tuple[str, str]]

MACHINE_CODE = {'numba', 'llvmlite', 'numpy', *sys.stdlib_module_names}

REPORTS_OWN = {'accuracy/peers/quickstart.py': {'pybullet'}, 'accuracy/crowds/depth.py': {'mujoco'}}


def modules(package: Path) -> dict[str, Path]:
    """Every module's dotted name, without the package's, and its file."""
    found = {}
    for path in package.rglob('*.py'):
        parts = path.relative_to(package).with_suffix('').parts
        found['.'.join(parts[:-1] if parts[-1] == '__init__' else parts)] = path
    return found


def imports(package: Path) -> Edges:
    """Every import (module, what it imports), also within functions and under TYPE_CHECKING.

    What is of the package is named by its module; other libraries as in the code, after a colon.
    """
    known = modules(package)
    edges = []
    for name, path in known.items():
        inside = [package.name, *filter(None, name.split('.'))]
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Import):
                targets = [alias.name for alias in node.names]
            elif isinstance(node, ast.ImportFrom):
                above = len(inside) + (path.name == '__init__.py') - node.level
                base = '.'.join([*(inside[:above] if node.level else []),
                                 *filter(None, [node.module])])
                targets = [f'{base}.{alias.name}' for alias in node.names]
            else:
                continue
            for target in targets:
                root, _, rest = target.partition('.')
                if root != package.name:
                    edges.append((name, f':{target}'))
                else:
                    edges.append((name, rest if rest in known else rest.rpartition('.')[0]))
    return edges


def broken_arrows(edges: Edges) -> list[str]:
    """Imports that no arrow allows."""
    found = []
    for name, target in edges:
        room, other = name.partition('.')[0], target.partition('.')[0]
        if target.startswith(':') or room == other or room == '' or target == '':
            continue
        tied = name.startswith(TIED.get(other, ()))
        if not tied and other not in ARROWS.get(room, set()):
            found.append(f'{name} -> {target}')
        if room == 'physics' and other == 'files' and not name.startswith('physics.engine.'):
            found.append(f'{name} -> {target}: only an engine wants a text')
        if room == 'fit' and other == 'physics' and name not in (
                'fit.judging.drop_test', 'fit.judging.fall_cost'):
            found.append(f'{name} -> {target}: only a fall of the finished doll wants physics')
    for name, target in edges:
        if name.startswith('physics.kernels') and not target.startswith('physics.kernels') and (
                target[0] != ':' or target[1:].partition('.')[0] not in MACHINE_CODE):
            found.append(f'{name} -> {target}: kernels are machine code and nothing else')
        for room, floors in FLOORS.items():
            if name.startswith(f'{room}.') and target.startswith(f'{room}.'):
                floor, other = (floors.index(side.removeprefix(f'{room}.').partition('.')[0])
                                for side in (name, target))
                if other > floor:
                    found.append(f'{name} -> {target}: a floor above it')
    return found


def circle(edges: Edges) -> list[str]:
    """A circle of imports between modules, or none; what is imported within a function counts."""
    graph: dict[str, set[str]] = {}
    for name, target in edges:
        if not target.startswith(':') and target != name and not name.startswith(target + '.'):
            graph.setdefault(name, set()).add(target)
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        return error.args[1]
    return []


@pytest.fixture(scope='module')
def edges():
    """The imports of the package, read once."""
    return imports(PACKAGE)


def test_rooms_are_those_of_the_plan():
    rooms = {path.name for path in PACKAGE.iterdir() if path.is_dir() and path.name != '__pycache__'
             and any(path.rglob('*.py'))}
    assert rooms == set(ARROWS)
    assert {path.name for path in PACKAGE.glob('*.py')} == {'__init__.py'}


@pytest.mark.parametrize('room', ['physics', 'ros', 'accuracy'])
def test_a_floor_has_at_most_a_dozen_files(room):
    assert len(list((PACKAGE / room).glob('*.py'))) <= 12


def test_imports_follow_the_arrows(edges):
    assert broken_arrows(edges) == []


def test_imports_close_no_circle(edges):
    assert circle(edges) == []


@pytest.mark.parametrize('library', ONLY)
def test_a_library_is_imported_in_one_place(edges, library):
    files = modules(PACKAGE)
    places = {str(files[name].relative_to(PACKAGE)) for name, target in edges
              if target[1:].partition('.')[0] == library and target.startswith(':')}
    places -= {place for place, own in REPORTS_OWN.items() if library in own}
    assert places and all(place.startswith(ONLY[library]) for place in places), places


def copy_with(tmp_path: Path, file: str, line: str) -> Path:
    """A small package with one import more than it may have."""
    package = tmp_path / 'ragdoll_ros'
    for name in ('model/scene.py', 'model/push.py', 'physics/simulation.py', 'ros/node.py',
                 'fit/shapes/axes.py', 'physics/kernels/contact/jacobian.py',
                 'physics/kernels/stepping/contact_step.py', 'viewer/page.py',
                 'viewer/sources/node/source.py'):
        path = package / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text('')
    for folder in {path.parent for path in package.rglob('*.py')}:
        (folder / '__init__.py').touch()
    (package / file).write_text(line)
    return package


@pytest.mark.parametrize(('file', 'line'), [
    ('model/scene.py', 'from ..physics.simulation import Simulation'),
    ('model/scene.py', 'from ragdoll_ros.physics import simulation'),
    ('physics/simulation.py', 'def late():\n    from ..ros import node'),
    ('viewer/page.py', 'from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n'
                       '    from ..ros.node import RagdollNode'),
    ('physics/kernels/stepping/contact_step.py', 'from ....model.scene import Scene'),
    ('physics/kernels/stepping/contact_step.py', 'import scipy.linalg'),
    ('physics/kernels/contact/jacobian.py', 'from ..stepping.contact_step import finish_step'),
    ('fit/shapes/axes.py', 'from ..skeleton.groups import Group')])
def test_an_arrow_that_is_broken_on_purpose_is_found(tmp_path, file, line):
    assert broken_arrows(imports(copy_with(tmp_path, 'model/push.py', ''))) == []
    assert len(broken_arrows(imports(copy_with(tmp_path, file, line)))) == 1


def test_what_listens_to_a_node_may_know_the_ros_room(tmp_path):
    package = copy_with(tmp_path, 'viewer/sources/node/source.py', 'from ...ros import node')
    assert broken_arrows(imports(package)) == []


def test_a_circle_made_on_purpose_is_found(tmp_path):
    package = copy_with(tmp_path, 'model/scene.py', 'from .push import Push')
    assert circle(imports(package)) == []
    (package / 'model/push.py').write_text('def late():\n    from .scene import Scene')
    assert set(circle(imports(package))) == {'model.scene', 'model.push'}
