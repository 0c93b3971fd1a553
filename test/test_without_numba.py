"""All works without numba too, by PyBullet: where it is missing, broken or told to rest."""
from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
FALL = """
import dataclasses
import numpy as np
from ragdoll_ros import Push, Simulation, load_scene
from ragdoll_ros.physics.engine.doll_totals import DollSums
scene = load_scene('flight')
spun = dataclasses.replace(scene.dolls[0], spin=(3.0, 20.0, 5.0))
with Simulation(dataclasses.replace(scene, dolls=(spun,))) as simulation:
    begun = DollSums(simulation.scene).totals(simulation.state).energy[0]
    simulation.push(Push('torso', force=(100, 0, 50), duration=0.05))
    for _ in range(10):
        state = simulation.advance()
    masses = [bone.mass for bone in simulation.scene.bones]
    momentum = masses @ state.linear_velocities
    assert np.allclose(momentum, (5, 0, 2.5), rtol=0, atol=1e-9), momentum
    assert simulation.measures()['energy_excess_J'] < 1e-3 * begun
with Simulation(load_scene('drop')) as simulation:
    head = simulation.scene.bone_index('head')
    height = simulation.state.positions[head, 2]
    simulation.grab('hand', 'head')
    for _ in range(30):
        fallen = height - simulation.advance().positions[head, 2]
    assert 0.005 < fallen < 0.05, 'held, it sags; let go it would fall by 0.44 m'
    simulation.let_go('hand')
    down = False
    for _ in range(300):
        simulation.advance()
        down |= simulation.state.positions[:, 2].max() < 1 and len(simulation.contacts) > 0
    assert down
    measures = simulation.measures()
    assert measures['joint_gap_m'] < 1e-6 and measures['sinking_m'] < 0.01
    assert measures['energy_excess_J'] < 1
print(simulation.engine_name, simulation.engine_reason)
"""
"""A doll that spins is pushed in the air: momentum is force times time, energy from nothing is less
than 0.1 %, where plain PyBullet makes 30 J. A hang by a hand, and a fall."""
GONE = "import sys; sys.modules['numba'] = None\n"


HAIR = """
import numpy as np
from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.model.rotation import from_rotation_vector
from ragdoll_ros.model.state import State
from ragdoll_ros.model.swing_mount import mount_swings
from ragdoll_ros.physics.swing.swings import Swings
scene = load_scene('ponytail')
def motion(t):
    turn = np.outer(np.ones(10), [0.2, 0.1, 0.3])
    return State(turn * np.sin(9 * t), from_rotation_vector(turn * np.sin(9 * t)),
                 9 * turn * np.cos(9 * t), 9 * turn * np.cos(9 * t))
swings = Swings(mount_swings(scene), scene.gravity, motion)
for index in range(20):
    state = swings.evaluate(index / 60)
print(np.round(state.positions, 9).tolist(), np.round(state.orientations, 9).tolist())
"""
"""A ponytail on a head that shakes, at times that are none of its grid. To the last bit, turns of
the head are not the same without machine code."""


def told(code, **environment):
    """Last line of what a process of its own prints."""
    path = os.pathsep.join([str(ROOT), os.environ.get('PYTHONPATH', '')])
    done = subprocess.run([sys.executable, '-c', code], check=False, capture_output=True, text=True,
                          env={**os.environ, 'PYTHONPATH': path, **environment})
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()[-1].strip()


def test_it_does_without_numba():
    assert told(GONE + FALL) == 'bullet numba is missing'


def test_it_does_where_numba_is_told_to_rest():
    assert told(FALL, NUMBA_DISABLE_JIT='1') == 'bullet NUMBA_DISABLE_JIT is set'


def test_hair_swings_alike_without_numba():
    assert told(GONE + HAIR) == told(HAIR) == told(HAIR, NUMBA_DISABLE_JIT='1')


@pytest.mark.parametrize('error', ['ImportError', 'AttributeError', 'SystemError'])
def test_it_does_with_a_broken_numba(tmp_path, error):
    """As where numpy or Python is too new for it: numba is there, and raises this or that."""
    (tmp_path / 'numba.py').write_text(f"raise {error}('Numba needs NumPy 2.2 or less')\n")
    code = f'import sys; sys.path.insert(0, {str(tmp_path)!r})\n' + FALL
    assert told(code) == 'bullet numba does not work here: Numba needs NumPy 2.2 or less'


def test_the_rigid_engine_says_what_it_lacks():
    code = GONE + """
from ragdoll_ros import RagdollError, Simulation, load_scene
try:
    Simulation(load_scene('drop'), engine='rigid')
except RagdollError as error:
    print(error)
"""
    assert told(code).startswith('engine rigid: numba is missing; expected')


@pytest.mark.slow
def test_it_does_where_nothing_can_be_kept(tmp_path):
    """As for a user without a home, the package being another's. A file stands here where the
    folders were to be. All kernels are compiled; test_kernel_cache.py does it with two small ones.
    """
    pytest.importorskip('numba', reason='numba is not installed')
    package = tmp_path / 'ragdoll_ros'
    shutil.copytree(ROOT / 'ragdoll_ros', package, ignore=shutil.ignore_patterns('__pycache__'))
    (package / 'config').symlink_to(ROOT / 'config')
    (package / 'physics' / 'kernels' / '__pycache__').write_text('')
    code = f'import sys; sys.path.insert(0, {str(tmp_path)!r})\n' + FALL
    assert told(code, HOME='/dev/null', XDG_CACHE_HOME='/dev/null',
                PYTHONDONTWRITEBYTECODE='1') == 'rigid'


def test_it_is_used_where_it_is():
    pytest.importorskip('numba', reason='numba is not installed')
    assert told(FALL) == 'rigid'
