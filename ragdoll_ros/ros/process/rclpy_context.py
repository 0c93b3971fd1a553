"""rclpy from init to shutdown, as a context manager."""
from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress

import rclpy
from rclpy._rclpy_pybind11 import RCLError
from rclpy.executors import ExternalShutdownException


@contextmanager
def rclpy_context(arguments: list[str]) -> Iterator[None]:
    """Initialize rclpy, and shut it down at the end of the context, or at SIGINT or SIGTERM.

    rclpy's signal handler invalidates the context while a callback may still use it, so errors
    after a shutdown are ignored. Exits with 2 and a message if rclpy cannot be initialized.
    """
    try:
        rclpy.init(args=arguments)
    except RuntimeError as error:  # e.g. the log directory is missing or read-only
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
        # The signal handler's thread may be shutting down at the same time.
        with suppress(RCLError):
            rclpy.try_shutdown()
