"""All works without numba too: where it is missing, broken or switched off."""
from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
FALL = """
import sys
import numpy as np
from ragdoll_ros import Push, Simulation, load_scene
from ragdoll_ros.physics import kernels
with Simulation(load_scene('flight')) as simulation:
    simulation.push(Push('torso', force=(100, 0, 50), duration=0.05))
    for _ in range(10):
        state = simulation.advance()
    masses = [bone.mass for bone in simulation.scene.bones]
    assert np.allclose(masses @ state.linear_velocities, (5, 0, 2.5), rtol=0, atol=1e-9)
    assert simulation.measures()['error_estimate_m'] < 1e-4
with Simulation(load_scene('drop')) as simulation:
    head = simulation.scene.bone_index('head')
    height = simulation.state.positions[head, 2]
    simulation.grab('hand', 'head')
    for _ in range(30):
        fallen = height - simulation.advance().positions[head, 2]
    assert 0.005 < fallen < 0.02, 'held, it sags by some 11 mm; let go it would fall by 0.44 m'
    simulation.let_go('hand')
    for _ in range(90):
        simulation.advance()
    assert simulation.state.positions[:, 2].max() < 1 and simulation.contacts, 'it is down'
    measures = simulation.measures()
    assert measures['joint_gap_m'] < 1e-6 and measures['sinking_m'] < 0.01
    assert measures['energy_excess_J'] < 1 and measures['stopped_total'] == 0
print(kernels.ready(), sys.modules.get('numba') is not None)
"""
"""A push in the air, against force times time; a hang by a hand, and a fall, within the bounds of
test_grab.py and test_simulation.py.
"""
GONE = "import sys; sys.modules['numba'] = None\n"


def told(code, **environment):
    """Last line of what a process of its own prints."""
    path = os.pathsep.join([str(ROOT), os.environ.get('PYTHONPATH', '')])
    done = subprocess.run([sys.executable, '-c', code], check=False, capture_output=True, text=True,
                          env={**os.environ, 'PYTHONPATH': path, **environment})
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()[-1]


def test_the_switch_turns_it_off():
    """And numba is not so much as imported, which takes a third of a second."""
    assert told(FALL, RAGDOLL_COMPILED='0') == 'False False'


@pytest.mark.parametrize('switch', ['', '1'])
def test_it_does_without_numba(switch):
    assert told(GONE + FALL, RAGDOLL_COMPILED=switch) == 'False False'


def test_it_does_with_a_broken_numba(tmp_path):
    """As where numpy is too new for it: numba is there, and raises ImportError."""
    (tmp_path / 'numba.py').write_text("raise ImportError('Numba needs NumPy 2.2 or less')\n")
    code = f'import sys; sys.path.insert(0, {str(tmp_path)!r})\n' + FALL
    assert told(code, RAGDOLL_COMPILED='1') == 'False False'


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
    assert told(code, HOME='/dev/null', XDG_CACHE_HOME='/dev/null', PYTHONDONTWRITEBYTECODE='1',
                RAGDOLL_COMPILED='1') == 'True True'


def test_it_is_used_where_it_is():
    pytest.importorskip('numba', reason='numba is not installed')
    assert told(FALL, RAGDOLL_COMPILED='1') == 'True True'
