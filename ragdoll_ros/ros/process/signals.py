"""Shutdown signals: SIGINT and SIGTERM end a program with its exit code, from import to exit.

Without this, Python answers SIGINT with a traceback during its imports, which take a second with
ROS and an engine, and dies by the signal during its exit.
"""
from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Callable
from pathlib import Path

SHUTDOWN_SIGNALS = (signal.SIGINT, signal.SIGTERM)

PROGRAMS = ('ragdoll_node', 'ragdoll_ros.ros.node', 'ragdoll_ros.ros.run')
"""Scripts and modules whose main() calls run_until_signal."""

REPEAT_DELAY = 0.02
"""s after which a signal is repeated that hit a callback of C code: time for it to return."""


def block_signals() -> None:
    """Block the shutdown signals until run_until_signal, if this process runs one of PROGRAMS.

    The mask survives the exec by which rclpy's wheels restart Python.
    """
    if any(Path(word).name in PROGRAMS for word in sys.orig_argv[1:3]):
        signal.pthread_sigmask(signal.SIG_BLOCK, SHUTDOWN_SIGNALS)


def run_uninterrupted(shutdown: Callable[[], None]) -> None:
    """Run a shutdown function to its end even if the first signal arrives during it.

    rclpy handles the signals as well and may shut down before Python's handler runs; the
    KeyboardInterrupt would then hit the shutdown function.
    """
    try:
        for number in SHUTDOWN_SIGNALS:
            signal.signal(number, lambda *_: None)
    except KeyboardInterrupt:  # from the first signal; later ones do not interrupt
        pass
    finally:
        shutdown()


def run_until_signal(run: Callable[[], int]) -> int:
    """Call ``run`` and return its exit code, or 0 if the first shutdown signal ends it.

    Further signals are ignored, also after the return. If the signal arrives in a callback from C
    code, as while machine code is loaded, its exception is lost; the signal is then repeated.
    """
    received = []
    report = sys.unraisablehook

    def on_signal(number: int, _: object) -> None:
        received.append(number)
        if len(received) == 1:
            raise KeyboardInterrupt

    def on_unraisable(lost: sys.UnraisableHookArgs) -> None:
        if lost.exc_type is not KeyboardInterrupt:
            report(lost)
            return
        again = threading.Timer(REPEAT_DELAY, os.kill, (os.getpid(), received.pop()))
        again.daemon = True
        again.start()

    try:
        sys.unraisablehook = on_unraisable
        for number in SHUTDOWN_SIGNALS:
            signal.signal(number, on_signal)
        signal.pthread_sigmask(signal.SIG_UNBLOCK, SHUTDOWN_SIGNALS)
        return run()
    except KeyboardInterrupt:
        return 0
    finally:
        for number in SHUTDOWN_SIGNALS:
            signal.signal(number, signal.SIG_IGN)
        sys.unraisablehook = report
        # After a KeyboardInterrupt in an exec or eval of a string, as in a dataclass, a module that
        # was run by -m would die by SIGINT at its exit, though it was caught. An eval clears that.
        eval('0')
