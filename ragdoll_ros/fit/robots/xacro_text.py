"""Text of a xacro, expanded by the package xacro, where that is installed."""
from __future__ import annotations

import contextlib
import io
from pathlib import Path

from ...model import errors


def expand_xacro(path: Path) -> str:
    """URDF of a xacro file, with the default of each argument. Evaluates the file's expressions.

    Raises Unreadable: xacro is not installed, or refuses the file. OSError: it cannot be read.
    """
    try:
        import xacro
    except ImportError:
        raise errors.Unreadable('', path.name, 'a URDF: xacro, which makes one of it, is not '
                                'installed (pip install xacro, or ros-jazzy-xacro)') from None
    path.read_bytes()
    try:
        # xacro explains its own errors on stderr, beside what it raises.
        with contextlib.redirect_stderr(io.StringIO()):
            return xacro.process_file(str(path)).toxml()
    except (Exception, SystemExit) as error:
        why = ' '.join(str(error).split()) or type(error).__name__
        raise errors.Unreadable('', path.name, f'a xacro that expands: {why} (for arguments '
                                'without a default: xacro FILE NAME:=VALUE > robot.urdf, with its '
                                'ROS packages sourced)') from None
