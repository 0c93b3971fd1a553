"""ROS from its start to a signal."""
from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress

import rclpy
from rclpy._rclpy_pybind11 import RCLError
from rclpy.executors import ExternalShutdownException


@contextmanager
def ros_session(arguments: list[str]) -> Iterator[None]:
    """Have ROS until the context ends, or until SIGINT or SIGTERM ends it, which is no error.

    rclpy shuts down where the signal finds it, so that whatever a callback in progress does
    next with ROS fails: errors after a shutdown are its consequence. Where ROS does not even start
    the process ends with 2, and says why.
    """
    try:
        rclpy.init(args=arguments)
    except RuntimeError as error:  # such as a log that has no folder, or one that is read-only
        print(f'ROS does not start: {error}', file=sys.stderr)
        raise SystemExit(2) from error
    try:
        yield
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    except Exception:
        if rclpy.ok():
            raise
    finally:
        # The thread that takes the signal may be shutting down at this very moment.
        with suppress(RCLError):
            rclpy.try_shutdown()
