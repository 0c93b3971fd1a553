"""Compiles what every simulation calls, so that no program has to do it at its first start."""
from __future__ import annotations

import argparse
import contextlib
import signal
import subprocess
import sys
import time

from . import problem

EXAMPLE = """examples:
  python -m ragdoll_ros.physics.kernels
  NUMBA_CACHE_DIR=/var/cache/ragdoll python -m ragdoll_ros.physics.kernels  keeps the result there;
                                           nodes that are to find it want the same variable
"""

NOT_READY = 'Nothing to compile with: {}; the node runs engine bullet then'


def main(arguments: list[str] | None = None) -> int:
    """Compile the kernels that every simulation calls. ``arguments``: of the command line, None for
    sys.argv. Returns the exit code: 0, or 2 if kernels cannot be compiled here.
    """
    argparse.ArgumentParser(
        'python -m ragdoll_ros.physics.kernels', description=__doc__, epilog=EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter).parse_args(arguments)
    if problem():
        print(NOT_READY.format(problem()), file=sys.stderr)
        return 2
    began = time.monotonic()
    from .compiling import cache
    with contextlib.ExitStack() as stack:
        if cache.KEPT:  # a process beside this one compiles swings; what fails there fails below
            stack.enter_context(subprocess.Popen(
                [sys.executable, '-c', f'import {__package__}.swing.loaded'],
                stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL))
        from . import loaded  # noqa: F401  importing compiles
    from .swing import loaded as swings  # noqa: F401
    is_kept = cache.KEPT and cache.KernelCache.failure is None
    kept = f'kept in {cache.FOLDER}' if is_kept else 'kept nowhere'
    print(f'The dynamics are compiled: {time.monotonic() - began:.1f} s, {kept}')
    return 0


if __name__ == '__main__':
    # Ctrl-C ends it at once: an exception within the compiler would be lost, or become another one.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    sys.exit(main())
