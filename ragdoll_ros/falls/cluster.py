"""Shards made by a Ray cluster, or by a Ray on this machine alone."""
from __future__ import annotations

from collections.abc import Iterable, Iterator

from ..model.errors import Unreadable
from .pool import AHEAD, TRIES, WorkersDied
from .shard import Order, Shard, make_shard

HERE = 'local'
"""Address of a Ray that is begun for this run on this machine."""


def make_shards(order: Order, shards: Iterable[int], address: str = HERE,
                workers: int | None = None) -> Iterator[Shard]:
    """Shards by their numbers, each as soon as it is done, by tasks of one core each.

    Ray does again what a process or a machine that dies takes with it, TRIES times in all. Files
    are written here: no folder need be shared. ``workers`` bounds a local Ray.
    """
    try:
        import ray
    except ImportError:
        raise Unreadable('', '--ray', "Ray: pip install 'ragdoll_ros[ray]'") from None
    try:
        ray.init(address=address, num_cpus=workers if address == HERE else None,
                 include_dashboard=False if address == HERE else None, log_to_driver=False)
    except (ConnectionError, ValueError) as error:
        raise Unreadable('', f'--ray {address}', f'a Ray cluster there: {error}') from None
    try:
        make = ray.remote(num_cpus=1, max_retries=TRIES - 1)(make_shard)
        shared, left, making = ray.put(order), iter(shards), []
        most = AHEAD * int(ray.cluster_resources().get('CPU', 1))
        while True:
            while len(making) < most and (shard := next(left, None)) is not None:
                making.append(make.remote(shared, shard))
            if not making:
                return
            (done,), making = ray.wait(making)
            yield ray.get(done)
    except ray.exceptions.WorkerCrashedError as error:
        raise WorkersDied(str(error)) from None
    finally:
        ray.shutdown()
