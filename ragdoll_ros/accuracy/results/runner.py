"""Runs the jobs of all parts: those that are not timed side by side, the timed ones alone."""
from __future__ import annotations

import concurrent.futures
import multiprocessing
import os
import sys
import tempfile
import time
import traceback
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from ...physics.engine.substepped.mujoco import silence_warnings
from .figures import Row

WORKERS = 2
"""Processes; PyBullet never releases the GIL, so more cores need more of them."""


@dataclass(frozen=True)
class RunOptions:
    """How much to run. ``starts`` of each class at each of our settings; quick: 2."""

    quick: bool = False
    starts: int = 100


@dataclass(frozen=True)
class Job:
    """A piece of work that gives rows for a part. ``weight``: about how many seconds it takes."""

    part: str
    label: str
    work: Callable[[], list[Row]]
    weight: float = 1.0
    timed: bool = False
    """CPU time is measured: nothing else may run beside it."""


def run_jobs(jobs: Sequence[Job]) -> dict[str, list[Row]]:
    """Each part's rows in the order of its jobs; a job that fails gives a row that says so."""
    progress = ProgressBar(sum(job.weight / (1 if job.timed else WORKERS) for job in jobs))
    results: dict[int, list[Row]] = {}
    together = [index for index, job in enumerate(jobs) if not job.timed]
    # spawn: a forked copy of a process that holds PyBullet clients is in no defined state
    context = multiprocessing.get_context('spawn')
    if together:
        with concurrent.futures.ProcessPoolExecutor(WORKERS, context, initializer=prepare) as pool:
            futures = {pool.submit(attempt, jobs[index]): index for index in together}
            for future in concurrent.futures.as_completed(futures):
                index = futures[future]
                results[index] = future.result()
                progress.advance(jobs[index].weight / WORKERS, jobs[index].label)
    prepare()
    for index, job in enumerate(jobs):
        if job.timed:
            results[index] = attempt(job)
            progress.advance(job.weight, job.label)
    progress.close()
    rows: dict[str, list[Row]] = {}
    for index, job in enumerate(jobs):
        rows.setdefault(job.part, []).extend(results[index])
    return rows


def attempt(job: Job) -> list[Row]:
    """The rows of a job; one that fails gives a row that says so, and leaves the others theirs."""
    try:
        return job.work()
    except Exception as error:
        place = traceback.extract_tb(error.__traceback__)[-1]
        return [{'failed': f'{type(error).__name__}: {error}', 'job': job.label,
                 'at': f'{os.path.basename(place.filename)}:{place.lineno}'}]


def prepare() -> None:
    """Keep MuJoCo's warnings about diverging runs off the terminal: the figures tell of them."""
    silence_warnings()
    os.chdir(tempfile.gettempdir())


class ProgressBar:
    """Counts finished pieces of ``total`` weight; a bar on a terminal, else a line now and then."""

    WIDTH = 30
    QUIET = 15.0
    """s between lines where stderr is no terminal."""

    def __init__(self, total: float) -> None:
        self._total = max(total, 1e-9)
        self._done = 0.0
        self._began = self._said = time.monotonic()
        self._terminal = sys.stderr.isatty()

    def advance(self, weight: float, label: str) -> None:
        """Note that a piece of ``weight`` is done."""
        self._done += weight
        now = time.monotonic()
        if self._terminal:
            filled = round(self.WIDTH * self._share)
            bar = '#' * filled + '.' * (self.WIDTH - filled)
            sys.stderr.write(f'\r[{bar}] {self._text(now)} {label[:40]:40}')
            sys.stderr.flush()
        elif now - self._said > self.QUIET:
            self._said = now
            sys.stderr.write(f'{self._text(now)} {label}\n')
            sys.stderr.flush()

    def close(self) -> None:
        """End the line."""
        if self._terminal:
            sys.stderr.write('\n')

    @property
    def _share(self) -> float:
        return min(1.0, self._done / self._total)

    def _text(self, now: float) -> str:
        gone = now - self._began
        left = gone * (1 / self._share - 1) if self._share > 0.02 else None
        rest = '' if left is None else f', about {left:.0f} s left'
        return f'{self._share:4.0%} {gone:.0f} s{rest}'
