"""Make shards in a pool of processes on this machine."""
import multiprocessing
import os
import signal
import threading
from collections import Counter
from collections.abc import Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from multiprocessing.connection import Connection

from ..model.errors import RagdollError
from .shard import DatasetJob, Shard, make_shard

QUEUED_PER_WORKER = 2
"""Shards queued or in work per worker, which bounds the memory."""

MAX_ATTEMPTS = 4
"""Attempts at a shard whose worker dies."""


class WorkersDied(RagdollError):
    """Worker processes died in all MAX_ATTEMPTS attempts at a shard."""


def make_shards(job: DatasetJob, shards: Iterable[int], workers: int) -> Iterator[Shard]:
    """Yield shards, made by ``workers`` processes, each as soon as it is done.

    If a process dies, all are replaced, and the shards that were queued or in work are made again;
    WorkersDied after MAX_ATTEMPTS at one of them.
    """
    left, attempts = list(shards)[::-1], Counter()
    while left:
        child_end, parent_end = multiprocessing.Pipe(duplex=False)
        # Not by fork: locks that other threads hold would stay locked in the child.
        pool = ProcessPoolExecutor(workers, multiprocessing.get_context('spawn'), _start,
                                   (job, child_end))
        making: dict[Future, int] = {}
        try:
            while left or making:
                while left and len(making) < QUEUED_PER_WORKER * workers:
                    making[pool.submit(_make, left[-1])] = left[-1]
                    left.pop()
                for done in wait(making, return_when=FIRST_COMPLETED).done:
                    shard = done.result()
                    del making[done]
                    yield shard
        except BrokenProcessPool:
            _count_attempts(attempts, making.values())
            left += sorted(making.values(), reverse=True)
        finally:
            parent_end.close()
            pool.shutdown(cancel_futures=True)


def _count_attempts(attempts: Counter, shards: Iterable[int]) -> None:
    attempts.update(shards)
    shard, most = attempts.most_common(1)[0]
    if most >= MAX_ATTEMPTS:
        raise WorkersDied(f'shard {shard}: {most} processes died while making it')


def _start(job: DatasetJob, child_end: Connection) -> None:
    """Initialise a worker: ignore Ctrl-C, and exit when the parent closes the pipe or dies."""
    global _job
    _job = job
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_exit_with, args=(child_end,), daemon=True).start()


def _exit_with(child_end: Connection) -> None:
    child_end.poll(None)
    os._exit(1)


def _make(shard: int) -> Shard:
    return make_shard(_job, shard)
