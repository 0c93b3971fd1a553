"""Run the jobs of all parts: timed ones alone, the others in parallel."""
import concurrent.futures
import multiprocessing
import os
import sys
import tempfile
import time
import traceback
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from ...physics.engine.substepped.engine import FrictionWarning
from ...physics.engine.substepped.mujoco import silence_warnings
from .figures import Row

WORKERS = 2
"""Processes; threads would not do, as PyBullet never releases the GIL."""


@dataclass(frozen=True)
class RunOptions:
    """Extent of a run. ``starts`` of each class at each of our accuracies; 2 if quick."""

    quick: bool = False
    starts: int = 100


@dataclass(frozen=True)
class Job:
    """Work that returns rows of a part; ``weight`` is its approximate duration, s."""

    part: str
    label: str
    work: Callable[[], list[Row]]
    weight: float = 1.0
    timed: bool = False
    """Measures CPU time, so that no other job may run at the same time."""


def run_jobs(jobs: Sequence[Job]) -> dict[str, list[Row]]:
    """Rows of each part in the order of its jobs; a failed job gives a row with its error."""
    progress = ProgressBar(sum(job.weight / (1 if job.timed else WORKERS) for job in jobs))
    results: dict[int, list[Row]] = {}
    together = [index for index, job in enumerate(jobs) if not job.timed]
    # Not fork: the copy of a process with PyBullet clients has no defined state.
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
    """Rows of a job, or one row with its error."""
    try:
        return job.work()
    except Exception as error:
        place = traceback.extract_tb(error.__traceback__)[-1]
        return [{'failed': f'{type(error).__name__}: {error}', 'job': job.label,
                 'at': f'{os.path.basename(place.filename)}:{place.lineno}'}]


def prepare() -> None:
    """Silence warnings about diverging runs and friction, which show in figures and notes, and
    change to the directory for temporary files.
    """
    silence_warnings()
    warnings.simplefilter('ignore', FrictionWarning)
    os.chdir(tempfile.gettempdir())


class ProgressBar:
    """Progress on stderr: a bar on a terminal, else a line every LOG_INTERVAL."""

    WIDTH = 30
    LOG_INTERVAL = 15.0
    """s between lines if stderr is no terminal."""

    def __init__(self, total: float) -> None:
        self._total = max(total, 1e-9)
        self._done = 0.0
        self._began = self._printed = time.monotonic()
        self._terminal = sys.stderr.isatty()

    def advance(self, weight: float, label: str) -> None:
        """Count a finished job of ``weight``."""
        self._done += weight
        now = time.monotonic()
        if self._terminal:
            filled = round(self.WIDTH * self._share)
            bar = '#' * filled + '.' * (self.WIDTH - filled)
            sys.stderr.write(f'\r[{bar}] {self._text(now)} {label[:40]:40}')
            sys.stderr.flush()
        elif now - self._printed > self.LOG_INTERVAL:
            self._printed = now
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
        elapsed = now - self._began
        left = elapsed * (1 / self._share - 1) if self._share > 0.02 else None
        rest = '' if left is None else f', about {left:.0f} s left'
        return f'{self._share:4.0%} {elapsed:.0f} s{rest}'
