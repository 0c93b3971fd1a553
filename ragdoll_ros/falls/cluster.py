"""Make shards on a Ray cluster, or with a local Ray instance."""
from __future__ import annotations

from collections.abc import Iterable, Iterator

from ..model.errors import Unreadable
from .pool import MAX_ATTEMPTS, QUEUED_PER_WORKER, WorkersDied
from .shard import DatasetJob, Shard, make_shard

LOCAL = 'local'
"""Address of a Ray instance started on this machine for this run."""


def make_shards(job: DatasetJob, shards: Iterable[int], address: str = LOCAL,
                workers: int | None = None) -> Iterator[Shard]:
    """Yield shards, each as soon as it is done, made by tasks of one core each.

    Ray repeats the tasks of a process or machine that dies, MAX_ATTEMPTS in all. Files are written
    by this process: no shared folder is needed. ``workers`` limits a local Ray.
    """
    try:
        import ray
    except ImportError:
        raise Unreadable('', '--ray', "Ray: pip install 'ragdoll_ros[ray]'") from None
    try:
        ray.init(address=address, num_cpus=workers if address == LOCAL else None,
                 include_dashboard=False if address == LOCAL else None, log_to_driver=False)
    except (ConnectionError, ValueError) as error:
        raise Unreadable('', f'--ray {address}', f'a Ray cluster there: {error}') from None
    try:
        make = ray.remote(num_cpus=1, max_retries=MAX_ATTEMPTS - 1)(make_shard)
        shared, left, making = ray.put(job), iter(shards), []
        most = QUEUED_PER_WORKER * int(ray.cluster_resources().get('CPU', 1))
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
