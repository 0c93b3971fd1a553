"""Shards made by processes on this machine."""
from __future__ import annotations

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
from .shard import Order, Shard, make_shard

AHEAD = 2
"""Shards that wait or are made for each worker: no more, so that memory stays as it is."""

TRIES = 4
"""Times that a shard is begun whose worker dies."""


class WorkersDied(RagdollError):
    """A shard that ends every process which makes it."""


def make_shards(order: Order, shards: Iterable[int], workers: int) -> Iterator[Shard]:
    """Shards by their numbers, made by ``workers`` processes, each as soon as it is done.

    A process that dies takes what it made with it, which others make again: WorkersDied after
    TRIES of the same.
    """
    left, tries = list(shards)[::-1], Counter()
    while left:
        watched, held = multiprocessing.Pipe(duplex=False)
        # Not by fork: what threads hold at that instant is held for ever in the child.
        pool = ProcessPoolExecutor(workers, multiprocessing.get_context('spawn'), _start,
                                   (order, watched))
        making: dict[Future, int] = {}
        try:
            while left or making:
                while left and len(making) < AHEAD * workers:
                    making[pool.submit(_make, left[-1])] = left[-1]
                    left.pop()
                for done in wait(making, return_when=FIRST_COMPLETED).done:
                    shard = done.result()
                    del making[done]
                    yield shard
        except BrokenProcessPool:
            _count(tries, making.values())
            left += sorted(making.values(), reverse=True)
        finally:
            held.close()
            pool.shutdown(cancel_futures=True)


def _count(tries: Counter, shards: Iterable[int]) -> None:
    tries.update(shards)
    shard, most = tries.most_common(1)[0]
    if most >= TRIES:
        raise WorkersDied(f'shard {shard}: {most} processes died that were to make it')


def _start(order: Order, watched: Connection) -> None:
    """Begin as a worker: leave Ctrl-C to who started it, and end when that closes its end of a
    pipe, or dies, whatever is being made.
    """
    global _order
    _order = order
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with, args=(watched,), daemon=True).start()


def _end_with(watched: Connection) -> None:
    watched.poll(None)
    os._exit(1)


def _make(shard: int) -> Shard:
    return make_shard(_order, shard)
