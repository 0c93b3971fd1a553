"""A real Ray on this machine makes the same bytes as this process."""
import sys
from functools import partial

import pytest
from falls_recipes import DROP, contents, recipe

from ragdoll_ros.falls import cluster
from ragdoll_ros.falls.generate import run
from ragdoll_ros.falls.shard import SIZE, Order, make_shard
from ragdoll_ros.model.errors import Unreadable

pytest.importorskip('pyarrow')
ORDER = Order(recipe(DROP, duration=0.2), 4 * SIZE)


@pytest.mark.slow
def test_the_same_bytes_by_ray(tmp_path):
    pytest.importorskip('ray')
    run(ORDER, tmp_path / 'here', lambda order, shards: (make_shard(order, k) for k in shards))
    run(ORDER, tmp_path / 'ray', partial(cluster.make_shards, workers=2))
    assert contents(tmp_path / 'ray') == contents(tmp_path / 'here')


def test_without_ray_it_says_how_to_get_it(monkeypatch):
    monkeypatch.setitem(sys.modules, 'ray', None)
    with pytest.raises(Unreadable, match=r'ragdoll_ros\[ray\]'):
        next(cluster.make_shards(ORDER, [0]))
