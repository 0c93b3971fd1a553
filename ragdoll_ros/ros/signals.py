"""Signals that end a program: from its first import to its last line they end it with its code.

Python by itself answers SIGINT with a traceback while it imports, which takes a second with ROS and
an engine, and with death by the signal while it ends.
"""
from __future__ import annotations

import signal
import sys
from collections.abc import Callable
from pathlib import Path

ENDING = (signal.SIGINT, signal.SIGTERM)

PROGRAMS = ('ragdoll_node', 'ragdoll_ros.ros.node', 'ragdoll_ros.ros.run')
"""Scripts and modules that answer signals by ended_by_signals."""


def hold_back() -> None:
    """Let signals wait until ended_by_signals, if this process runs one of the PROGRAMS.

    They wait also while rclpy's wheels start Python anew.
    """
    if any(Path(word).name in PROGRAMS for word in sys.orig_argv[1:3]):
        signal.pthread_sigmask(signal.SIG_BLOCK, ENDING)


def end_unbroken(end: Callable[[], None]) -> None:
    """Run what ends a program whole, though the first signal comes only now.

    ROS takes signals too, and may shut down before Python does: what ran has ended by then, and
    the interrupt would come in the midst of the end.
    """
    try:
        for number in ENDING:
            signal.signal(number, lambda *_: None)
    except KeyboardInterrupt:  # the first signal's; no later one interrupts
        pass
    finally:
        end()


def ended_by_signals(run: Callable[[], int]) -> int:
    """Run what the first signal may end at any time, which is no error; give the exit code.

    Further signals, and all that come later, do nothing.
    """
    got = []

    def take(number: int, _: object) -> None:
        got.append(number)
        if len(got) == 1:
            raise KeyboardInterrupt

    try:
        for number in ENDING:
            signal.signal(number, take)
        signal.pthread_sigmask(signal.SIG_UNBLOCK, ENDING)
        return run()
    except KeyboardInterrupt:
        return 0
    finally:
        for number in ENDING:
            signal.signal(number, signal.SIG_IGN)
