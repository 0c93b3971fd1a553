"""What all tests share: this tree on the path, and a ROS domain of their own."""
from __future__ import annotations

import gc
import importlib.util
import os
import signal
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent

# Tests start some three hundred processes. Without bytecode each would compile the package anew,
# as each process of pytest would all tests.
os.environ.pop('PYTHONDONTWRITEBYTECODE', None)
sys.dont_write_bytecode = False

FILES_THAT_NEED = {'rclpy': ['test_ros_*.py'],
                   'mcap': ['test_replay*.py', 'test_ros_replay.py', 'test_viewer_recording.py',
                            'test_recordings_formats.py'],
                   'rosbags': ['test_replay*.py', 'test_ros_replay.py', 'test_viewer_recording.py'],
                   'viser': ['test_viewer*.py', 'test_editor*.py', 'test_ros_browser.py'],
                   'trimesh': ['test_viewer_paint.py'], 'rtree': ['test_viewer_paint.py']}

collect_ignore_glob = [file for package, files in FILES_THAT_NEED.items()
                       if importlib.util.find_spec(package) is None for file in files]


LONGEST = ('test_ros_viewer.py', 'test_viewer_seen.py', 'test_viewer_browser.py', 'test_heaps.py',
           'test_viewer_editing.py', 'test_viewer_accessibility.py', 'test_ros_teleop.py',
           'test_viewer_transport.py', 'test_viewer_limp.py', 'test_falls_run.py',
           'test_viewer_look.py', 'test_viewer_walks.py', 'test_ros_stamps.py',
           'test_hull_decomposition.py', 'test_ros_motor_slider.py', 'test_fit_wild.py',
           'test_moving_hulls.py', 'test_limp.py', 'test_hair_skin.py', 'test_package.py',
           'test_viewer_motors.py', 'test_viewer_crowd.py', 'test_ros_browser.py',
           'test_falls_formats.py', 'test_ros_process.py', 'test_animations.py',
           'test_viewer_typed.py', 'test_surfaces.py', 'test_viewer.py', 'test_collision.py',
           'test_viewer_amiss.py', 'test_dynamics.py', 'test_ros_programs.py',
           'test_static_bodies.py', 'test_viewer_paint.py', 'test_editor.py',
           'test_ros_pushing.py', 'test_solver.py', 'test_viewer_timeline.py',
           'test_recordings_character.py', 'test_viewer_pushing.py', 'test_readme.py',
           'test_tutorial.py', 'test_fit_split_characters.py', 'test_ros_signals.py',
           'test_swing_colliders.py', 'test_ros_parameters.py', 'test_viewer_command.py',
           'test_ros_fuzz.py', 'test_add_remove.py', 'test_falls.py', 'test_swing.py',
           'test_peers.py', 'test_compiled_cache.py', 'test_ros_full_disk.py',
           'test_without_numba.py', 'test_ros_replay.py', 'test_fit_command.py',
           'test_viewer_static.py', 'test_viewer_time.py')
"""Those that work and those that wait in turn, so that both keep the processors busy."""


def pytest_configure(config):
    """By itself pytest-xdist begins with the files of the most tests, which are not the longest.

    A shell starts what runs in the background, as CI may, with SIGINT ignored, and so would all
    programs that tests start: those that Ctrl-C should end would run on.

    No garbage is collected until all tests are: a third of that time would go into it.
    """
    gc.disable()
    config.option.loadscopereorder = False
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_collection_modifyitems(items):
    """Files that take longest go first, so that no process is left with one of them at the end."""
    items.sort(key=lambda item: LONGEST.index(item.path.name) if item.path.name in LONGEST
               else len(LONGEST))


def pytest_collection_finish(session):
    """What has been imported and collected stays: no collection of garbage walks it again.

    Nor does every 700th object begin one: of a test that reads the syntax of all files, which keeps
    a million of them, that takes three quarters.
    """
    gc.freeze()
    gc.set_threshold(50_000)
    gc.enable()


def light():
    """Environment of a process that ends soon and is not measured: PyBullet will do.

    To load machine code takes 0.1 s of a processor's time; a node that runs needs 0.07 s more with
    PyBullet in each second.
    """
    return {**os.environ, 'NUMBA_DISABLE_JIT': '1'}


@pytest.fixture(scope='session')
def ros():
    """ROS in this process, in a domain that it shares with the processes it starts alone."""
    import rclpy
    from peer import free_domain
    from rclpy.signals import SignalHandlerOptions
    domain, lock = free_domain()
    os.environ['ROS_DOMAIN_ID'] = str(domain)
    os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
    os.environ['PYTHONPATH'] = os.pathsep.join(
        filter(None, [str(ROOT), os.environ.get('PYTHONPATH', '')]))
    # By itself rclpy takes SIGTERM, such as timeout's, and shuts down: all tests that follow fail.
    rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
    yield
    rclpy.try_shutdown()
    lock.close()


@pytest.fixture(scope='session')
def recording():
    """The first 1.2 s of the scene `drop`."""
    from ragdoll_ros.files.scene import load_scene
    from ragdoll_ros.physics.simulation import Simulation
    from ragdoll_ros.recordings.recording import Recorder
    scene = load_scene('drop')
    recorder = Recorder(scene)
    with Simulation(scene) as simulation:
        for _ in range(120):
            recorder.take(simulation)
            simulation.advance()
    return recorder.recording()


@pytest.fixture
def peer(ros):
    """The other side of a node, for one test."""
    from peer import Peer
    peer = Peer()
    yield peer
    peer.destroy_node()


@pytest.fixture
def nothing_runs_on(ros):
    """Kill what a test that failed has left running."""
    from peer import STARTED, kill
    before = len(STARTED)
    yield
    for process in STARTED[before:]:
        kill(process)


@pytest.fixture
def make_node(ros):
    """Make ragdoll nodes in this process, with parameters as keywords; destroyed at the end."""
    from rclpy.parameter import Parameter

    from ragdoll_ros.ros.node import RagdollNode
    nodes = []

    def make(**parameters):
        overrides = [Parameter(name, value=value) for name, value in parameters.items()]
        nodes.append(RagdollNode(parameter_overrides=overrides))
        return nodes[-1]

    yield make
    for node in nodes:
        node.destroy_node()


@pytest.fixture
def broken_scene(tmp_path):
    """A scene's file with five errors, and a word for each that must be told."""
    path = tmp_path / 'broken.yaml'
    path.write_text("""name: broken
gravity: [0, 0]
step: -0.01
pace: fast
ground: {normal: [0, 0, 0]}
dolls:
  - {doll: nowhere.yaml}
""")
    return path, ['broken.yaml: 5 errors', 'gravity', 'step', 'pace', 'ground.normal',
                  'dolls[0].doll']
