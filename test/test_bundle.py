"""How compiled code is put together: functions linked through functions, arrays by one pointer."""
from __future__ import annotations

import collections
import os
import subprocess
import sys

import numpy as np
import pytest

pytest.importorskip('numba')
import numba

from ragdoll_ros.physics.kernels.compiling.bundle import bind, bundle_at, bundle_type
from ragdoll_ros.physics.kernels.compiling.decorators import compiled


@compiled
def _cubed(x):
    return x * x * x


@compiled
def _and_one(x):
    return _cubed(x) + 1.0


@compiled
def _tenfold(x):
    return 10.0 * _and_one(x)


@compiled
def _by_two_ways(x):
    return _tenfold(x) + _cubed(x)


@numba.njit
def down_a_chain(x):
    return _tenfold(x)


@numba.njit
def down_both_ways(x):
    return _by_two_ways(x) + _and_one(2.0 * x)


def test_what_is_called_is_linked_with_all_that_it_calls_itself():
    """Down a chain, and by two ways to one function; what is missing would end the process, so it
    is another's.
    """
    here = os.path.dirname(__file__)
    code = 'from test_bundle import *\nprint(down_a_chain(3.0), down_both_ways(3.0))'
    path = os.pathsep.join([here, os.path.dirname(here), os.environ.get('PYTHONPATH', '')])
    done = subprocess.run([sys.executable, '-c', code], capture_output=True, text=True,
                          env={**os.environ, 'PYTHONPATH': path})
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == ['280.0', '524.0'], '10 (27 + 1); that and 27 and 6^3 + 1'


RECORD = np.dtype([('flag', np.int64), ('place', float, 3), ('turn', float, (2, 2))], align=True)
Inner = collections.namedtuple('Inner', 'counts cube')
Outer = collections.namedtuple('Outer', 'row inner table records last')


def parts(scale=1):
    """Arrays of all ranks, no two lengths alike, with numbers that tell where they are."""
    return Outer(
        row=np.arange(5.0) * scale,
        inner=Inner(np.arange(7) - 3, np.arange(24.0).reshape(2, 3, 4) * scale),
        table=np.arange(6.0).reshape(3, 2) * scale, records=np.zeros(4, RECORD),
        last=np.arange(9.0))


AT = bundle_at(bundle_type(parts()))


@compiled
def _alter(inner, records, k):
    inner.cube[1, 2, k] = -inner.counts[k]
    record = records[k]
    record.flag += k
    record.place[1], record.turn[1, 0] = 0.5, 0.25


@numba.njit
def _write(address):
    outer = AT(address)
    for k in range(outer.inner.cube.shape[2]):
        _alter(outer.inner, outer.records, k)
    outer.row[len(outer.row) - 1] = outer.table[2, 1] + outer.last[len(outer.last) - 1]
    outer.table[1, 0] = outer.inner.cube[0, 1, 3]
    outer.table[0][1] = outer.table.size


@numba.njit
def _read(address):
    outer = AT(address)
    shapes = (outer.row.shape, outer.inner.counts.shape, outer.inner.cube.shape,
              outer.table.shape, outer.records.shape, outer.last.shape)
    return shapes, outer.row.sum() + outer.inner.cube.sum() + outer.table[:, 1].sum()


def test_a_bundle_reads_the_very_arrays():
    own = parts(scale=3)
    rows = bind(own)
    for _ in range(2):
        shapes, total = _read(rows[0].ctypes.data)
        assert shapes == ((5,), (7,), (2, 3, 4), (3, 2), (4,), (9,))
        # numbers small enough for their sums to be exact in any order
        assert total == own.row.sum() + own.inner.cube.sum() + own.table[:, 1].sum()
        own.row[2], own.table[0, 1], own.inner.cube[1, 0, 2] = 100, 1000, 10000


def test_a_bundle_writes_into_the_very_arrays_and_nowhere_else():
    own, due = parts(), parts()
    rows = bind(own)
    _write(rows[0].ctypes.data)
    due.inner.cube[1, 2] = -due.inner.counts[:4]
    due.records['flag'] = range(4)
    due.records['place'][:, 1], due.records['turn'][:, 1, 0] = 0.5, 0.25
    due.row[4] = 5 + 8
    due.table[1, 0], due.table[0, 1] = 7, 6
    for found, wanted in zip((*own, *own.inner), (*due, *due.inner), strict=True):
        if not isinstance(wanted, tuple):
            assert found.tobytes() == wanted.tobytes()


def test_a_bundle_is_of_arrays_without_gaps():
    """It has no strides: of every second row it would read the wrong ones."""
    with pytest.raises(AssertionError):
        bind(Inner(np.zeros(3), np.zeros((4, 2, 2))[::2]))
