"""Serves a page that shows dolls in a browser: of a node `ragdoll`, a scene, or a recording."""
from __future__ import annotations

import argparse
import atexit
import contextlib
import errno
import importlib.util
import io
import ipaddress
import math
import os
import queue
import signal
import socket
import sys
import tempfile
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from ..files.scene import load_scene
from ..model import errors
from ..physics.engine.registry import ENGINES
from ..recordings.mcap_file import load_recording
from .sources.source import Source

if TYPE_CHECKING:
    from .start_when_visible import StartWhenVisible

PORT = 8080
LAST_PORT = 65535
HOST = '127.0.0.1'

PUBLIC_WARNING = ('Whoever reaches this machine at port {} may steer the dolls and write into {}; '
                  '--host 127.0.0.1 serves this machine alone')

DEFAULT_FOLDER = 'ragdolls'
"""In the user's home: where the page keeps files without --folder."""

REMEDIES = {
    errno.EADDRINUSE: f'without --port, the next free one from {PORT} on is used',
    errno.EACCES: 'ports below 1024 need root rights, unless the system allows them: expected '
                  f'one from 1024 to {LAST_PORT}'}
"""What to do about a port that cannot be used."""

STOP_TIMEOUT = 0.5
"""s that viser may take to close its connections."""

EXAMPLE = """examples:
  ragdoll_viewer                          show the node `ragdoll`
  ragdoll_viewer --ros-args -r __ns:=/stage     ... in another namespace
  ragdoll_viewer --scene doll.yaml        simulate a doll or scene here
  ragdoll_viewer --scene crowd --port 9000 --engine bullet
  ragdoll_viewer --play run.mcap          show a recording
  ragdoll_viewer --static out/ --scene drop     write a page that works without a server
"""

NO_VISER = ("ragdoll_viewer needs viser: pip install 'ragdoll_ros[viewer]', or, for the Python of "
            "Ubuntu's ROS, PIP_BREAK_SYSTEM_PACKAGES=1 pip install viser")

NO_ROS = ("without --scene, ragdoll_viewer shows a node over ROS 2: source ROS, or "
          "pip install 'ragdoll_ros[ros]', or name a scene: ragdoll_viewer --scene drop")


class CannotServe(errors.RagdollError):
    """No page can be served with these options."""


def main(arguments: list[str] | None = None) -> int:
    """Serve the page until SIGINT or SIGTERM; exit code 2 if the options do not allow it."""
    arguments = sys.argv[1:] if arguments is None else arguments
    at = arguments.index('--ros-args') if '--ros-args' in arguments else len(arguments)
    options, for_ros = parser().parse_args(arguments[:at]), arguments[at:]
    stop = stop_on_signals()
    try:
        if importlib.util.find_spec('viser') is None:
            # Checked before the kernels are compiled, which takes a minute or two.
            raise CannotServe(NO_VISER)
        check_options(options, for_ros)
        if options.static is not None:
            write_static(options)
        else:
            serve(options, for_ros, stop)
    except errors.RagdollError as error:
        print(error, file=sys.stderr)
        return 2
    return 0


def stop_on_signals() -> threading.Event:
    """Return an event that SIGINT and SIGTERM set.

    A handler may interrupt the main thread while that thread holds the event's lock. So the handler
    only puts into a queue, which is reentrant, and another thread sets the event.
    """
    stop, signals = threading.Event(), queue.SimpleQueue()

    def take() -> None:
        signals.get()
        stop.set()

    for sign in (signal.SIGINT, signal.SIGTERM):
        signal.signal(sign, lambda *_: signals.put(None))
    threading.Thread(target=take, name='signals', daemon=True).start()
    return stop


def parser() -> argparse.ArgumentParser:
    """Parser of the command line."""
    parser = argparse.ArgumentParser(
        'ragdoll_viewer', description=__doc__, epilog=EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter)
    shown = parser.add_mutually_exclusive_group()
    shown.add_argument('--play', metavar='RUN.mcap', help='show a recording of the page or of '
                       '`ros2 bag record`')
    shown.add_argument('--scene', help='simulate a scene here, without ROS: a name in config/ or '
                       'a path (default: show the node `ragdoll`)')
    parser.add_argument('--static', metavar='FOLDER', help='do not serve: write the fall of '
                        '--scene, or the run of --play, as FOLDER/index.html, which a browser '
                        'shows from any web server or from disk')
    parser.add_argument('--engine', choices=ENGINES, help='physics engine of --scene (auto); for '
                        'a node, set its parameter `engine`')
    parser.add_argument('--host', default=HOST, help='address to serve at (%(default)s: this '
                        'machine alone; 0.0.0.0: whoever reaches this machine may steer)')
    parser.add_argument('--port', type=port, help=f'port ({PORT}, or the next free one)')
    parser.add_argument('--start-after', type=seconds, metavar='S', help='resume a node that was '
                        'started with start_paused when a page shows it, or after S seconds '
                        'without a page; then the first page starts the scene again')
    parser.add_argument('--folder', help='where the page saves and loads scenes and uploaded '
                        f'characters (~/{DEFAULT_FOLDER}, created if missing); pages can write '
                        'nowhere else')
    return parser


def port(text: str) -> int:
    """Parse a port number; 0 stands for any free port."""
    number = int(text) if text.isdecimal() else -1
    if not 0 <= number <= LAST_PORT:
        raise argparse.ArgumentTypeError(
            f'{text}: expected a whole number up to {LAST_PORT}; 0 stands for any free port')
    return number


def seconds(text: str) -> float:
    """Parse a duration, s, 0 or more; may be inf."""
    try:
        duration = float(text)
    except ValueError:
        duration = math.nan
    if not duration >= 0:
        raise argparse.ArgumentTypeError(f'{text}: expected seconds, 0 or more')
    return duration


def check_options(options: argparse.Namespace, for_ros: list[str]) -> None:
    """Raise CannotServe for options that exclude each other, or lack one that they require."""
    chosen = next((f'--{key}' for key in ('scene', 'play')
                   if getattr(options, key) is not None), '')
    if options.static is not None and (not chosen or for_ros):
        raise CannotServe('--static: expected --scene or --play with it, and no ROS arguments; '
                          "record a node's run first: ros2 bag record")
    if chosen and for_ros:
        raise CannotServe(f'{" ".join(for_ros)}: not with {chosen}, which does not use ROS')
    if options.engine is not None and options.scene is None:
        raise CannotServe(f'--engine {options.engine}: only with --scene')
    if options.start_after is not None and chosen:
        raise CannotServe(f'--start-after {options.start_after:g}: not with {chosen}, which always '
                          'waits for a page')


def serve(options: argparse.Namespace, for_ros: list[str], stop: threading.Event) -> None:
    """Serve the page until ``stop`` is set; RagdollError."""
    number = free_port(options.host, options.port)
    source = make_source(options, for_ros)
    try:
        # Last, as it may create a folder.
        folder = folder_for_files(options.folder)
        Page = page_class()
        with server_at(options.host, number) as server:
            page = Page(server, source, folder)
            page.start_when_visible = start_when_visible(options, source)
            # In one piece: without a buffer, another process's line could come before its end.
            print(f'The page is at http://{url_host(options.host)}:{server.get_port()}\n', end='',
                  flush=True)
            if is_public(options.host):
                print(PUBLIC_WARNING.format(server.get_port(), folder), file=sys.stderr, flush=True)
            page.run(stop)
    finally:
        source.close()


def folder_for_files(requested: str | None) -> Path:
    """Where the page keeps files: the ``requested`` folder; CannotServe if it is not writable.

    By default DEFAULT_FOLDER, created if missing, or a temporary one where that is impossible.
    """
    folder = Path(requested) if requested is not None else Path.home() / DEFAULT_FOLDER
    if requested is None:
        try:
            folder.mkdir(exist_ok=True)
        except OSError as error:
            folder = Path(tempfile.mkdtemp(prefix='ragdolls_'))
            print(f'{error.filename}: {error.strerror}; the page keeps its files in {folder}; '
                  '--folder selects another', file=sys.stderr)
    if not folder.is_dir() or not os.access(folder, os.W_OK | os.X_OK):
        raise CannotServe(f'--folder {folder}: expected a folder that can be written to')
    return folder


def write_static(options: argparse.Namespace) -> None:
    """Write the page that needs no server; RagdollError."""
    scene = None if options.scene is None else load_scene(options.scene)
    page_class()
    from .static import fall, save_static
    recording = (load_recording(options.play) if scene is None
                 else fall(scene, options.engine or 'auto'))
    path = save_static(recording, options.static)
    print(f'{path}: {recording.duration:.1f} s, {path.stat().st_size / 1e6:.1f} MB')


def page_class() -> type:
    """Import the page, which takes longest, after all checks; CannotServe without viser."""
    try:
        import viser  # noqa: F401
    except ImportError as error:
        raise CannotServe(f'{error}: {NO_VISER}') from None
    from .page import Page
    return Page


def make_source(options: argparse.Namespace, for_ros: list[str]) -> Source:
    """The source that the options select; RagdollError."""
    if options.play is not None:
        from .sources.playback import PlaybackSource
        return PlaybackSource(load_recording(options.play), Path(options.play).name)
    if options.scene is not None:
        scene = load_scene(options.scene)
        from .sources.simulation import SimulationSource
        return SimulationSource(scene, options.engine or 'auto')
    try:
        from .sources.node.source import NodeSource
    except ImportError as error:
        raise CannotServe(f'{error}: {NO_ROS}') from None
    return NodeSource(for_ros)


def start_when_visible(options: argparse.Namespace, source: Source) -> StartWhenVisible | None:
    """Return what resumes a scene simulated here, which is paused, or a paused node, once a page
    shows it; None without --scene and --start-after.
    """
    from .start_when_visible import StartWhenVisible
    if options.scene is not None:
        source.pause(True)
        return StartWhenVisible(source, None)
    return None if options.start_after is None else StartWhenVisible(source, options.start_after)


def free_port(host: str, requested: int | None) -> int:
    """The requested port, or the first free one from PORT on; CannotServe if there is none."""
    for port in (requested,) if requested is not None else range(PORT, PORT + 100):
        try:
            family, *_, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
            with socket.socket(family, socket.SOCK_STREAM) as probe:
                probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
                probe.bind(address)
                return port
        except (OSError, UnicodeError) as error:
            refused = error
    remedy = REMEDIES.get(getattr(refused, 'errno', None),
                          f'expected an address of this machine, as {HOST}')
    reason = getattr(refused, 'strerror', None) or refused
    raise CannotServe(f'--host {host} --port {requested or PORT}: {reason}; {remedy}')


@contextlib.contextmanager
def server_at(host: str, port: int) -> Iterator[object]:
    """Yield viser's server, without its output.

    Viser takes 6 s to close each connection without a request, such as a browser keeps in reserve.
    So it gets STOP_TIMEOUT to stop, and is not stopped at the interpreter's exit.
    """
    import viser
    with contextlib.redirect_stdout(io.StringIO()):
        server = viser.ViserServer(host, port, label='ragdoll', verbose=False)
    try:
        yield server
    finally:
        with contextlib.redirect_stdout(io.StringIO()):
            atexit.unregister(server.stop)
            ending = threading.Thread(target=server.stop, daemon=True)
            ending.start()
            ending.join(STOP_TIMEOUT)


def is_public(host: str) -> bool:
    """Whether other machines can reach an address."""
    address = socket.getaddrinfo(host, None, type=socket.SOCK_STREAM)[0][4][0]
    return not ipaddress.ip_address(address.partition('%')[0]).is_loopback


def url_host(host: str) -> str:
    """Host part of a URL by which a browser on this machine reaches an address."""
    return {'0.0.0.0': '127.0.0.1', '::': '[::1]'}.get(host, f'[{host}]' if ':' in host else host)


if __name__ == '__main__':
    sys.exit(main())
