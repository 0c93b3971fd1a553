"""The package as built: what lies where, and that it agrees with itself."""
import ast
import email
import functools
import importlib
import json
import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
import zipfile
from pathlib import Path
from xml.etree import ElementTree

import pytest
import yaml

from ragdoll_ros.viewer.command import NO_VISER

ROOT = Path(__file__).resolve().parent.parent
SETUP = (ROOT / 'setup.py').read_text()
EXECUTABLES = dict(re.findall(r"'(ragdoll_\w+)': '([\w.]+:main)'", SETUP))
DEFAULTS_OF_A_SCENE = {'rate', 'real_time_factor', 'pushed_bone'}
SCENES = ('import ragdoll_ros; from ragdoll_ros.files import config; '
          'ragdoll_ros.load_scene("drop"); print(config.__file__); print(config.config_folder())')

ROSDEP_KEYS = {'numpy': 'python3-numpy', 'yaml': 'python3-yaml',
               'jsonschema': 'python3-jsonschema', 'numba': 'python3-numba',
               'pybullet': 'python3-pybullet-pip'}
DISTRIBUTIONS = {'yaml': 'pyyaml', 'mpl_toolkits': 'matplotlib', 'DracoPy': 'dracopy',
                 'mcap_ros2': 'mcap-ros2-support', 'pydrake': 'drake'}
"""Where a package on PyPI is called otherwise than its module."""

ROBOT = ('model', 'files', 'physics', 'realtime', 'ros')
"""Rooms that run on a robot, with OPTIONAL modules or without."""
OPTIONAL = {'mujoco', 'mcap', 'trimesh', 'vhacdx', 'imageio'}
OPTIONAL_IN_ROS = {'hri_msgs'}
"""Taken where the user's ROS has it; pip does not."""
NUMBAS = {'llvmlite'}
"""What numba is made of: who has numba has it."""
LAUNCHED = {'ament_index_python', 'launch', 'launch_ros', 'launch_xml'}
"""What the files in launch/ are read by and import."""
CLUSTER = {'ray'}
"""Wanted where there are several machines, by an extra of its name."""
PEERS = {'dartpy', 'pydrake'}
"""Compared in the report where they are installed, by an extra of their own."""
CALLED = {'fit': {'pycollada', 'scipy'}}
"""What a library of an extra imports in our stead: trimesh, to read DAE and for convex hulls."""
EXTRAS = {'fit': 'fit', 'viewer': 'viewer', 'accuracy': 'report', 'replay': 'replay',
          'recordings': 'replay', 'falls': 'falls'}
"""The other rooms, and the extra that brings what each needs beyond that."""

COUNT_POSES = """
import rclpy
from geometry_msgs.msg import PoseArray
got = rclpy.task.Future()
rclpy.init()
node = rclpy.create_node('listener')
node.create_subscription(PoseArray, '/ragdoll/poses', got.set_result, 10)
rclpy.spin_until_future_complete(node, got, timeout_sec=20)
print(len(got.result().poses))
"""


def source_copy(folder: Path) -> Path:
    """Copy what is tracked or would be, so that no build leaves its traces in the checkout."""
    skip = shutil.ignore_patterns('.*', 'build', 'install', 'log', 'dist', '*.egg-info',
                                  '__pycache__')
    return Path(shutil.copytree(ROOT, folder / 'source', ignore=skip))


def without_paths() -> dict[str, str]:
    """Give the environment without what leads back to the checkout."""
    return {key: value for key, value in os.environ.items()
            if key not in ('PYTHONPATH', 'AMENT_PREFIX_PATH', 'COLCON_PREFIX_PATH')}


def run(*command: object, cwd: Path = Path('/'), **variables: str) -> str:
    """Run a command outside the checkout to its good end; give what it prints."""
    done = subprocess.run([str(part) for part in command], env={**without_paths(), **variables},
                          cwd=cwd, capture_output=True, text=True, timeout=900)
    assert done.returncode == 0, f'{command}\n{done.stdout}\n{done.stderr}'
    return done.stdout


def with_ros(path: Path) -> str:
    """Put a folder before what PYTHONPATH holds already: a sourced ROS comes that way."""
    return os.pathsep.join(filter(None, [str(path), os.environ.get('PYTHONPATH')]))


@pytest.fixture(scope='module')
def wheel(tmp_path_factory):
    """Build a wheel with the setuptools at hand: no network, no other versions."""
    folder = tmp_path_factory.mktemp('wheel')
    run(sys.executable, '-m', 'pip', '--quiet', 'wheel', '--no-deps', '--no-build-isolation',
        '--wheel-dir', folder, source_copy(folder))
    return next(folder.glob('*.whl'))


@pytest.fixture(scope='module')
def prefix(wheel, tmp_path_factory):
    """Install that wheel into a prefix of its own, as `pip install .` does into an environment."""
    folder = tmp_path_factory.mktemp('prefix')
    run(sys.executable, '-m', 'pip', '--quiet', 'install', '--no-deps', '--prefix', folder, wheel,
        PIP_IGNORE_INSTALLED='1')
    return folder


def imported(*rooms: str) -> set[str]:
    """Top-level modules that rooms import, but for Python's own and this package's."""
    return set().union(*map(imported_by_room, rooms))


@functools.cache
def imported_by_room(room: str) -> set[str]:
    """What one room imports."""
    nodes = [node for path in (ROOT / 'ragdoll_ros' / room).rglob('*.py')
             for node in ast.walk(ast.parse(path.read_text()))]
    plain = {name.name for node in nodes if isinstance(node, ast.Import) for name in node.names}
    froms = {node.module for node in nodes if isinstance(node, ast.ImportFrom) and not node.level}
    found = {name.split('.')[0] for name in plain | froms}
    return found - set(sys.stdlib_module_names) - {'ragdoll_ros'}


def metadata(wheel: Path) -> email.message.Message:
    """What setup.py says, as it reached the wheel."""
    with zipfile.ZipFile(wheel) as files:
        name = next(name for name in files.namelist() if name.endswith('.dist-info/METADATA'))
        return email.message_from_bytes(files.read(name))


def required(wheel: Path, extra: str | None = None) -> set[str]:
    """Distributions that pip installs with a wheel, or that an extra adds."""
    lines = [line.partition(';') for line in metadata(wheel).get_all('Requires-Dist')]
    return {re.match(r'[\w-]+', name)[0].lower() for name, _, condition in lines
            if (f'extra == "{extra}"' in condition.replace("'", '"') if extra
                else 'extra' not in condition)}


def distributions(modules: set[str]) -> set[str]:
    return {DISTRIBUTIONS.get(module, module) for module in modules}


def poses_published_by(python: Path, *command: object, **variables: str) -> int:
    """Start a node, count the poses in a message that another process hears, end the node."""
    with subprocess.Popen([str(part) for part in command], cwd='/',
                          env={**without_paths(), **variables}) as node:
        try:
            heard = int(run(python, '-c', COUNT_POSES))
        finally:
            node.send_signal(signal.SIGINT)
    assert node.returncode == 0
    return heard


def site_packages(prefix: Path) -> Path:
    return next(prefix.glob('lib/python3*/site-packages'))


def test_versions_and_words_agree(wheel):
    """package.xml, and setup.py as it reached the wheel."""
    manifest, built = ElementTree.parse(ROOT / 'package.xml').getroot(), metadata(wheel)
    for tag, header in (('name', 'Name'), ('version', 'Version'), ('description', 'Summary')):
        assert built[header].replace('-', '_') == manifest.findtext(tag).replace('-', '_')
    assert (built['License'] or built['License-Expression']) == manifest.findtext('license')


def test_changelog_has_the_headings_that_catkin_prepare_release_knows():
    """REP 132: what is not released is Forthcoming; the newest release is the manifest's."""
    headings = re.findall(r'^(\S.*)\n-+$', (ROOT / 'CHANGELOG.rst').read_text(), re.M)
    released = headings[headings[0] == 'Forthcoming':]
    assert headings and all(re.fullmatch(r'\d+\.\d+\.\d+ \(\d{4}-\d\d-\d\d\)', heading)
                            for heading in released)
    if released:
        assert released[0].split()[0] == ElementTree.parse(ROOT / 'package.xml').getroot().findtext(
            'version')


def test_manifest_names_what_a_robot_needs_and_nothing_else():
    """By the imports of the rooms that run there."""
    manifest = ElementTree.parse(ROOT / 'package.xml').getroot()
    assert manifest.findtext('export/build_type') == 'ament_python'
    declared = [tag.text for tag in manifest.iter() if tag.tag == 'exec_depend']
    used = imported(*ROBOT) - OPTIONAL - OPTIONAL_IN_ROS - NUMBAS | LAUNCHED
    assert sorted(ROSDEP_KEYS.get(module, module) for module in used) == sorted(declared)
    assert {tag.tag for tag in manifest.iter() if 'depend' in tag.tag} == {
        'exec_depend', 'test_depend'}


def test_manifest_leads_to_the_documentation():
    """rosdoc2 wants two YAML documents, the first of which says what they are."""
    manifest = ElementTree.parse(ROOT / 'package.xml').getroot()
    head, config = yaml.safe_load_all((ROOT / manifest.findtext('export/rosdoc2')).read_text())
    assert head == {'type': 'rosdoc2 config', 'version': 1}
    assert (ROOT / config['settings']['python_source'] / '__init__.py').is_file()
    assert [list(builder) for builder in config['builders']] == [['sphinx']]


def test_no_file_names_a_repository_that_does_not_exist(wheel):
    """REP 149's URLs are left out until there is one: a wrong one is worse than none."""
    assert ElementTree.parse(ROOT / 'package.xml').getroot().find('url') is None
    assert not metadata(wheel).get_all('Project-URL') and not metadata(wheel)['Home-page']


def test_the_node_needs_no_pybullet_for_its_own_engine():
    """What docs/ros.md leaves out where pip may not be used."""
    text = ('import sys; sys.modules["pybullet"] = None; import ragdoll_ros.ros.node; '
            'from ragdoll_ros import Simulation, load_scene; '
            'simulation = Simulation(load_scene("drop"), engine="rigid"); '
            'print(simulation.advance().positions.shape)')
    assert run(sys.executable, '-c', text, PYTHONPATH=with_ros(ROOT)).strip() == '(10, 3)'


def test_a_node_with_neither_numba_nor_pybullet_says_so_in_a_line(ros):
    text = ('import sys; sys.modules["pybullet"] = None; from ragdoll_ros.ros.node import main; '
            'sys.exit(main(["ragdoll_node"]))')
    done = subprocess.run([sys.executable, '-c', text], capture_output=True, text=True, timeout=60,
                          env={**os.environ, 'NUMBA_DISABLE_JIT': '1'})
    said = done.stderr.splitlines()[-1]
    assert done.returncode == 2 and 'Traceback' not in done.stderr
    assert 'engine bullet: ' in said and 'engine rigid: ' in said and 'numba 0.59' in said


def test_pip_brings_what_the_core_imports_and_extras_what_their_rooms_do(wheel):
    """ROS is an extra too."""
    core = imported('model', 'files', 'physics', 'people') - OPTIONAL - NUMBAS
    assert required(wheel) == distributions(core)
    rooms = {path.name for path in (ROOT / 'ragdoll_ros').iterdir() if any(path.glob('*.py'))}
    assert rooms == {*ROBOT, 'people', *EXTRAS}
    for room, extra in EXTRAS.items():
        needed = distributions(imported(room) - imported(*ROBOT) - PEERS) - CLUSTER
        assert needed == required(wheel, extra) - OPTIONAL - CALLED.get(extra, set()), room
    assert distributions(PEERS) == required(wheel, 'peers')


def test_docs_say_how_to_get_what_rosdep_does_not_know(wheel):
    """By an extra for an environment of one's own; and for ROS's Python, which Ubuntu guards.

    PEP 668: pip refuses to touch that one without a word of consent.
    """
    pages = '\n'.join(path.read_text() for path in (ROOT / 'README.md', *ROOT.glob('docs/*.md')))
    named = {extra for text in re.findall(r"pip install '\.\[(.*?)\]'", pages)
             for extra in text.split(',')}
    got = {name for extra in named for name in required(wheel, extra)}
    assert got >= OPTIONAL.union(*(required(wheel, extra) for extra in EXTRAS.values()))
    guide = (ROOT / 'docs/ros.md').read_text()
    command = 'PIP_BREAK_SYSTEM_PACKAGES=1 pip install viser'
    assert command in guide and command in NO_VISER
    assert 'PIP_BREAK_SYSTEM_PACKAGES=1 pip install numba' in guide


@pytest.mark.skipif(shutil.which('make') is None, reason='no make')
@pytest.mark.parametrize('distribution, body, told', [
    ('humble', 'pass', True), ('jazzy', 'add_post_set_parameters_callback = None', False)])
def test_make_refuses_a_ros_that_is_too_old(tmp_path, distribution, body, told):
    """By what its rclpy has. Whatever else comes of it: nothing can be set up in that place."""
    (tmp_path / 'rclpy').mkdir()
    (tmp_path / 'rclpy/__init__.py').write_text('')
    (tmp_path / 'rclpy/node.py').write_text(f'class Node:\n    {body}\n')
    done = subprocess.run(
        ['make', '-C', str(ROOT), 'lint', f'PYTHON={sys.executable}', 'VENV=/dev/null/venv'],
        env={**without_paths(), 'PYTHONPATH': str(tmp_path), 'ROS_DISTRO': distribution,
             'MAKEFLAGS': ''}, capture_output=True, text=True, timeout=60)
    assert done.returncode == 2
    assert (f'ROS {distribution} is sourced: Jazzy or newer is needed' in done.stderr) == told
    assert ('Setting up' in done.stdout) != told


def test_every_program_is_an_executable():
    """A node, a teleop or a command.py without its line in setup.py would never be installed."""
    programs = {'.'.join(path.relative_to(ROOT).with_suffix('').parts)
                for name in ('node', 'teleop', 'command')
                for path in ROOT.glob(f'ragdoll_ros/**/{name}.py')}
    assert {place.split(':')[0] for place in EXECUTABLES.values()} == programs


@pytest.mark.parametrize('place', EXECUTABLES.values(), ids=EXECUTABLES)
def test_an_executable_is_a_function_of_the_package(place):
    module, function = place.split(':')
    assert callable(getattr(importlib.import_module(module), function))


def test_wheel_holds_config_twice_and_nothing_foreign(wheel):
    names = zipfile.ZipFile(wheel).namelist()
    shipped = {path.name for path in (ROOT / 'config').rglob('*.*')}
    for part in ('ragdoll_ros/config/', '.data/data/share/ragdoll_ros/config/'):
        assert {Path(name).name for name in names if part in f'/{name}'} >= shipped, part
    assert 'ragdoll_ros/py.typed' in names
    page = {path.name for path in (ROOT / 'ragdoll_ros/viewer/browser').iterdir()
            if path.suffix in ('.js', '.css')}
    assert page and {Path(name).name for name in names
                     if name.startswith('ragdoll_ros/viewer/browser/')} >= page
    # Beside the package, its metadata and its data, a wheel's top level must hold nothing.
    assert {name.split('/')[0].split('-')[0] for name in names} == {'ragdoll_ros'}
    tests = {path.name for path in (ROOT / 'test').iterdir()}
    assert not tests & {Path(name).name for name in names}
    assert not any('test' in Path(name).parts for name in names)


def test_pip_install_has_the_layout_of_a_ros_prefix(prefix):
    assert (prefix / 'share/ament_index/resource_index/packages/ragdoll_ros').is_file()
    assert (prefix / 'share/ragdoll_ros/package.xml').is_file()
    assert {path.name for path in prefix.glob('share/ragdoll_ros/launch/*.*')} == {
        path.name for path in (ROOT / 'launch').glob('*.*')}
    for folder in ('lib/ragdoll_ros', 'bin'):
        assert {path.name for path in prefix.glob(f'{folder}/*')} == set(EXECUTABLES), folder
    assert all(os.access(prefix / 'lib/ragdoll_ros' / name, os.X_OK) for name in EXECUTABLES)


def test_scenes_are_found_in_the_prefix_and_without_one(prefix):
    """With AMENT_PREFIX_PATH those in share/, without it those in the package."""
    site = site_packages(prefix)
    path = with_ros(site)
    alone = run(sys.executable, '-c', SCENES, PYTHONPATH=path).splitlines()
    assert alone == [f'{site}/ragdoll_ros/files/config.py', f'{site}/ragdoll_ros/config']
    sourced = run(sys.executable, '-c', SCENES, PYTHONPATH=path, AMENT_PREFIX_PATH=str(prefix))
    assert sourced.splitlines()[1] == f'{prefix}/share/ragdoll_ros/config'


@pytest.mark.parametrize('name', EXECUTABLES)
def test_launcher_in_lib_starts_the_script_in_bin(prefix, name):
    """What `ros2 run` starts answers --help, from the prefix's own files."""
    said = run(prefix / 'lib/ragdoll_ros' / name, '--help',
               PYTHONPATH=with_ros(site_packages(prefix)))
    assert name in said


def test_uninstall_would_leave_nothing(prefix):
    """All that the build made by itself is on pip's record."""
    record = next(site_packages(prefix).glob('*.dist-info/RECORD'))
    listed = {(record.parent.parent / line.split(',')[0]).resolve()
              for line in record.read_text().splitlines()}
    present = {path.resolve() for path in prefix.rglob('*')
               if path.is_file() and path.suffix != '.pyc'}
    assert present <= listed


def test_parameter_file_holds_the_defaults():
    """All of them but those that the scene brings along."""
    from ragdoll_ros.ros.parameters.node_settings import NodeSettings
    given = yaml.safe_load((ROOT / 'config/node.yaml').read_text())['/**']['ros__parameters']
    # YAML has lists where settings, which are frozen, have tuples.
    defaults = {key: list(value) if isinstance(value, tuple) else value
                for key, value in vars(NodeSettings()).items() if key not in DEFAULTS_OF_A_SCENE}
    assert given == defaults
    assert {key: type(value) for key, value in given.items()} == {
        key: type(value) for key, value in defaults.items()}


@pytest.fixture(scope='module')
def environment(wheel, tmp_path_factory):
    """Make a fresh environment with all that the package needs and colcon, without the package."""
    folder = tmp_path_factory.mktemp('environment')
    run(sys.executable, '-m', 'venv', folder)
    run(folder / 'bin/pip', 'install', f'{wheel}[ros,colcon]')
    run(folder / 'bin/pip', 'uninstall', '--yes', 'ragdoll_ros')
    return folder


@pytest.mark.slow
def test_plain_pip_install_runs_the_node(ros, environment, tmp_path):
    """As `ros2 run` starts it, with and without a ROS prefix."""
    source = source_copy(tmp_path)
    run(environment / 'bin/pip', 'install', '.', cwd=source)
    shutil.rmtree(source)
    try:
        for name in EXECUTABLES:  # also without what the extras bring
            assert name in run(environment / 'lib/ragdoll_ros' / name, '--help')
        command = (environment / 'lib/ragdoll_ros/ragdoll_node', '--ros-args', '-p', 'scene:=crowd')
        python = environment / 'bin/python'
        assert poses_published_by(python, *command) == 100
        assert poses_published_by(python, *command, AMENT_PREFIX_PATH=str(environment)) == 100
    finally:
        run(environment / 'bin/pip', 'uninstall', '--yes', 'ragdoll_ros')


@pytest.mark.slow
@pytest.mark.parametrize('option', [(), ('--symlink-install',)], ids=['copied', 'symlinked'])
def test_colcon_build_runs_the_node(ros, environment, tmp_path, option):
    source_copy(tmp_path)
    path = f'{environment}/bin:{os.environ["PATH"]}'
    assert '(ros.ament_python)' in run('colcon', 'list', cwd=tmp_path, PATH=path)
    # Twice: the second build meets what the first one left.
    for _ in range(2):
        run('colcon', 'build', *option, cwd=tmp_path, PATH=path)
    prefix = tmp_path / 'install/ragdoll_ros'
    assert (prefix / 'share/ament_index/resource_index/packages/ragdoll_ros').is_file()
    for folder in ('config', 'config/recipes', 'config/limits', 'launch'):
        shipped = {file.name for file in (ROOT / folder).glob('*.*')}
        assert {file.name for file in prefix.glob(f'share/ragdoll_ros/{folder}/*.*')} == shipped
    assert {file.name for file in (prefix / 'lib/ragdoll_ros').iterdir()} == set(EXECUTABLES)
    assert not (prefix / 'bin').exists()
    sourced = f'. {tmp_path}/install/setup.sh && exec {prefix}/lib/ragdoll_ros/ragdoll_node "$@"'
    assert poses_published_by(environment / 'bin/python', 'sh', '-c', sourced, 'sh', '--ros-args',
                              '-p', 'scene:=crowd') == 100


def test_the_container_installs_what_setup_py_wants():
    """And each of its commands is one that a shell understands."""
    text = (ROOT / 'Dockerfile').read_text().replace('\\\n', '')
    lines = [line.partition(' ') for line in text.splitlines() if not line.startswith('#')]
    assert [word for word, _, _ in lines] == [
        'FROM', 'ENV', 'RUN', 'WORKDIR', 'COPY', 'RUN', 'RUN', 'RUN', 'RUN', 'ENTRYPOINT', 'CMD']
    commands = [rest for word, _, rest in lines if word == 'RUN']
    for command in commands:
        subprocess.run(['sh', '-n', '-c', command], check=True)
    pip, = (command for command in commands if command.startswith('pip'))
    assert all(f"'{wanted}'" in SETUP for wanted in shlex.split(pip)[2:])
    for _, _, rest in lines[-2:]:
        assert all(isinstance(word, str) for word in json.loads(rest))
    assert json.loads(lines[-1][2])[3] in EXECUTABLES


def test_the_conda_environment_has_what_package_xml_wants():
    tomllib = pytest.importorskip('tomllib')
    found = tomllib.loads((ROOT / 'pixi.toml').read_text())['dependencies']
    names = {'python3-pybullet-pip': 'pybullet', 'python3-yaml': 'pyyaml'}
    wanted = {each.text for each in ElementTree.parse(ROOT / 'package.xml').iter('exec_depend')}
    for name in wanted:
        conda = names.get(name, name.removeprefix('python3-') if name.startswith('python3-')
                          else f'ros-jazzy-{name.replace("_", "-")}')
        assert conda in found, name


def test_the_workflow_runs_what_must_hold():
    workflow = yaml.safe_load((ROOT / '.github/workflows/ci.yml').read_text())
    steps = workflow['jobs']['test']['steps']
    commands = [step['run'] for step in steps if 'run' in step]
    assert commands == ['.ci/run']
    assert os.access(ROOT / commands[0], os.X_OK)
    version = next(step['with']['python-version'] for step in steps if 'with' in step)
    assert tuple(map(int, version.split('.'))) >= (3, 10)
