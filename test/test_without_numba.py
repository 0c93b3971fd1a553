"""All works without numba too: where it is missing, broken or switched off."""
from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
FALL = """
import numpy as np
from ragdoll_ros import compiled
from ragdoll_ros.push import Push
from ragdoll_ros.scene_file import load_scene
from ragdoll_ros.simulation import Simulation
for name in ('flight', 'drop'):
    with Simulation(load_scene(name)) as simulation:
        simulation.grab('hand', 'head')
        simulation.push(Push('torso', force=(100, 0, 50), duration=0.05))
        for tick in range(40):
            if tick == 5:
                simulation.let_go('hand')
            state = simulation.advance()
        assert np.isfinite(state.rows).all()
        assert all(np.isfinite(value) for value in simulation.measures().values())
import sys
print(compiled.READY, sys.modules.get('numba') is not None)
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


def test_it_is_used_where_it_is():
    pytest.importorskip('numba', reason='numba is not installed')
    assert told(FALL, RAGDOLL_COMPILED='1') == 'True True'
