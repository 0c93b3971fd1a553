"""A real Ray on this machine makes the same bytes as this process."""
import sys
from functools import partial

import pytest
from falls_recipes import DROP, file_bytes, recipe

from ragdoll_ros.falls import cluster
from ragdoll_ros.falls.dataset_builder import build_dataset
from ragdoll_ros.falls.shard import FALLS_PER_SHARD, DatasetJob, make_shard
from ragdoll_ros.model.errors import Unreadable

pytest.importorskip('pyarrow')
JOB = DatasetJob(recipe(DROP, duration=0.2), 4 * FALLS_PER_SHARD)


@pytest.mark.slow
def test_the_same_bytes_by_ray(tmp_path):
    pytest.importorskip('ray')
    build_dataset(JOB, tmp_path / 'here',
                     lambda job, shards: (make_shard(job, k) for k in shards))
    build_dataset(JOB, tmp_path / 'ray', partial(cluster.make_shards, workers=2))
    assert file_bytes(tmp_path / 'ray') == file_bytes(tmp_path / 'here')


def test_without_ray_it_says_how_to_get_it(monkeypatch):
    monkeypatch.setitem(sys.modules, 'ray', None)
    with pytest.raises(Unreadable, match=r'ragdoll_ros\[ray\]'):
        next(cluster.make_shards(JOB, [0]))
