"""One digest of states by machine code for other processors, and by other ways of libm and BLAS.

Each is a process whose libraries and compiler are told that the processor is another one.
"""
import ast
import os
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip('numba')

ROOT = Path(__file__).resolve().parent.parent

FALL = """
import dataclasses, hashlib, math, sys
import numba
from ragdoll_ros import Push, Simulation, load_scene
from ragdoll_ros.accuracy.crowds.crowd_digests import of_workers
from ragdoll_ros.files.repeat import repeated
from ragdoll_ros.model.scene import Ground, Placement

def digest(scene, ticks, workers=1):
    found = hashlib.sha256()
    with Simulation(scene, engine='rigid', workers=workers) as simulation:
        names = scene.bone_names
        for tick in range(ticks):
            if tick % 100 == 20:
                simulation.push(Push(names[tick % len(names)], (300, 100, 50), (0, 5, 1)))
            found.update(simulation.advance().rows.tobytes())
    return found.hexdigest()

drop, flight = load_scene('drop'), load_scene('flight')
sunk = dataclasses.replace(drop, ground=Ground((0.3, 0.1, 0.9)), dolls=tuple(repeated(
    Placement(drop.dolls[0].doll, 'sunk', (0, 0, -0.3), spin=(1, 2, 3)),
    {'count': 8, 'grid': (9, 9, 0.0), 'columns': (4, 2), 'turned': 'yaw', 'seed': 3})))
print(digest(drop, 300), digest(flight, 300), digest(sunk, 10), digest(sunk, 10, 3),
      of_workers(1, 40)[0][0], of_workers(3, 40)[0][0])

@numba.njit(fastmath={'contract'})
def at_once(x, y, z):
    return x * y + z

print(sum(at_once(k / 7, k / 3, -(k / 7 * (k / 3))) != 0 for k in range(1000)),
      hashlib.sha256(repr([math.sin(k / 1000) for k in range(9000)]).encode()).hexdigest())
"""
"""States of a fall and a flight with pushes, of dolls that begin within a slope, and of a crowd,
the last two also by three threads; then what does depend on the processor: how often a product and
a sum are rounded at once, and the C library's sines."""

OLD = {'NUMBA_CPU_NAME': 'x86-64', 'NUMBA_CPU_FEATURES': '', 'OPENBLAS_CORETYPE': 'Prescott',
       'GLIBC_TUNABLES': 'glibc.cpu.hwcaps=-AVX512F,-AVX2,-FMA,-FMA4,-AVX'}
"""A processor of 2004: no FMA, no AVX."""

PROCESSORS = {
    'haswell': ({'fma', 'avx2'}, {'NUMBA_CPU_NAME': 'haswell', 'NUMBA_CPU_FEATURES': '',
                                  'OPENBLAS_CORETYPE': 'Haswell'}),
    'skylake-avx512': ({'avx512f', 'avx512vl', 'avx512dq', 'avx512bw'},
                       {'NUMBA_CPU_NAME': 'skylake-avx512', 'NUMBA_CPU_FEATURES': '',
                        'OPENBLAS_CORETYPE': 'SkylakeX'})}
"""What this one has to have to play another, and what makes it."""


def features():
    """What this processor can; nothing where Linux does not tell."""
    try:
        lines = Path('/proc/cpuinfo').read_text().splitlines()
    except OSError:
        return set()
    return set(next((line for line in lines if line.startswith('flags')), '').split())


def fall(folder, variables):
    """Digests of the states, and what else the program prints."""
    done = subprocess.run(
        [sys.executable, '-c', FALL], capture_output=True, text=True, timeout=600,
        env={**os.environ, 'PYTHONPATH': os.pathsep.join([str(ROOT), *sys.path[1:]]),
             'NUMBA_CACHE_DIR': str(folder), **variables})
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


@pytest.fixture(scope='module')
def old(tmp_path_factory):
    """What the program prints where the processor is an old one."""
    if not {'lm', 'sse2'} <= features():
        pytest.skip('not x86-64, or not Linux')
    return fall(tmp_path_factory.mktemp('old'), OLD)


ROUNDED_ONCE = {'sqrt', 'floor', 'ceil', 'copysign', 'isfinite', 'isnan', 'inf', 'pi', 'factorial',
                'ldexp'}
"""Of the module math: what is exact, or rounded as IEEE 754 says."""


def test_machine_code_calls_nothing_that_rounds_as_it_likes():
    for path in (ROOT / 'ragdoll_ros' / 'physics' / 'kernels').rglob('*.py'):
        for node in ast.walk(ast.parse(path.read_text())):
            where = f'{path.name}:{getattr(node, "lineno", 0)}'
            if isinstance(node, ast.Attribute) and ast.unparse(node.value) == 'math':
                assert node.attr in ROUNDED_ONCE, where
            elif isinstance(node, ast.BinOp) and isinstance(node.op, ast.Pow):
                assert isinstance(getattr(node.right, 'value', None), int) or ast.unparse(
                    node.left) == '-1', f'{where}: a power that is none of products'
            elif isinstance(node, ast.keyword):
                assert node.arg != 'fastmath', where


@pytest.mark.slow
def test_states_are_those_of_a_processor_without_fma(old, tmp_path):
    states, others = fall(tmp_path, {})
    assert states == old[0]
    one, three, crowd, crowd_of_three = states.split()[2:]
    assert (one, crowd) == (three, crowd_of_three)
    if 'fma' in features():
        assert others.split()[0] != '0' and old[1].split()[0] == '0'


@pytest.mark.slow
@pytest.mark.parametrize('name', PROCESSORS)
def test_states_are_those_of_another_processor(old, tmp_path, name):
    wanted, variables = PROCESSORS[name]
    if not wanted <= features():
        pytest.skip(f'this processor lacks {", ".join(sorted(wanted - features()))}')
    assert fall(tmp_path, variables)[0] == old[0]
