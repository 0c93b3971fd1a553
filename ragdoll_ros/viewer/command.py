"""Shows the doll on a page in the browser: a scene of its own, or that of a node `ragdoll`."""
from __future__ import annotations

import argparse
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
from .sources.source import Source

if TYPE_CHECKING:
    from .start_when_visible import Opening

PORT = 8080
LAST_PORT = 65535
HOST = '127.0.0.1'

OPEN_TO_ALL = ('Whoever reaches this machine at port {} may steer the dolls and write into {}; '
               '--host 127.0.0.1 serves this machine alone')

OWN_FOLDER = 'ragdolls'
"""Of the user's home: where the page keeps files unless --folder names another."""

REMEDIES = {
    errno.EADDRINUSE: f'without --port, the next free one from {PORT} on is taken',
    errno.EACCES: 'ports below 1024 are for root alone, unless the system says otherwise: expected '
                  f'one from 1024 to {LAST_PORT}'}
"""What to do about a port that cannot be had."""

ENDING = 0.5
"""s that viser may take to say goodbye to its pages."""

EXAMPLE = """examples:
  ragdoll_viewer                          show the node `ragdoll`
  ragdoll_viewer --ros-args -r __ns:=/stage     ... in another namespace
  ragdoll_viewer --scene doll.yaml        simulate a doll or scene here
  ragdoll_viewer --scene crowd --port 9000 --engine bullet
  ragdoll_viewer --play run.mcap          show a recording
  ragdoll_viewer --static out/ --scene drop     write a page that needs no server
"""

NO_VISER = ("ragdoll_viewer needs viser: pip install 'ragdoll_ros[viewer]', or, for the Python of "
            "Ubuntu's ROS, PIP_BREAK_SYSTEM_PACKAGES=1 pip install viser")

NO_ROS = ("without --scene, ragdoll_viewer listens to a node over ROS 2: source ROS, or "
          "pip install 'ragdoll_ros[ros]', or name a scene: ragdoll_viewer --scene drop")


class CannotServe(errors.RagdollError):
    """No page can be served as asked: with what would be right."""


def main(arguments: list[str] | None = None) -> int:
    """Serve the page until SIGINT or SIGTERM; 2 if it cannot be as asked."""
    arguments = sys.argv[1:] if arguments is None else arguments
    at = arguments.index('--ros-args') if '--ros-args' in arguments else len(arguments)
    options, for_ros = parser().parse_args(arguments[:at]), arguments[at:]
    stop = stopped_by_signals()
    try:
        if importlib.util.find_spec('viser') is None:
            # Said before machine code is made, which takes half a minute.
            raise CannotServe(NO_VISER)
        check(options, for_ros)
        if options.static is not None:
            write_static(options, for_ros)
        else:
            serve(options, for_ros, stop)
    except errors.RagdollError as error:
        print(error, file=sys.stderr)
        return 2
    return 0


def stopped_by_signals() -> threading.Event:
    """What SIGINT and SIGTERM set.

    A handler runs within whatever the main thread does, a wait for the event too, which holds its
    lock: it hands on to a thread, through a queue that may be put into within itself.
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
    """Options of the command."""
    parser = argparse.ArgumentParser(
        'ragdoll_viewer', description=__doc__, epilog=EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter)
    shown = parser.add_mutually_exclusive_group()
    shown.add_argument('--play', metavar='RUN.mcap', help='show what the page, or '
                       '`ros2 bag record`, has recorded')
    shown.add_argument('--scene', help='a name in config/ or a path: simulate it here, without '
                        'ROS (else: listen to the node `ragdoll`)')
    parser.add_argument('--static', metavar='FOLDER', help='serve nothing: write the fall of the '
                        '--scene, or the run to --play, as FOLDER/index.html, which any web server '
                        'shows, or a browser without one')
    parser.add_argument('--engine', choices=ENGINES, help='with --scene: what simulates (auto); a '
                        'node has a parameter for it')
    parser.add_argument('--host', default=HOST, help='address to serve at (%(default)s: this '
                        'machine alone; 0.0.0.0: whoever reaches this machine may steer)')
    parser.add_argument('--port', type=port, help=f'port to serve at; it must be free ({PORT}, or '
                        'the next free one)')
    parser.add_argument('--start-after', type=patience, metavar='S', help='the node waits, started '
                        'with start_paused: let it go once a page shows it, or after so many s '
                        'without one')
    parser.add_argument('--folder', help='where the page saves and loads scenes, and keeps the '
                        f'characters it is sent (~/{OWN_FOLDER}, made if missing); pages can write '
                        'nowhere else')
    return parser


def port(text: str) -> int:
    """Read a port's number; 0 stands for any free one."""
    number = int(text) if text.isdecimal() else -1
    if not 0 <= number <= LAST_PORT:
        raise argparse.ArgumentTypeError(
            f'{text}: expected a whole number up to {LAST_PORT}; 0 stands for any free port')
    return number


def patience(text: str) -> float:
    """Read for how long to wait for a page, s; inf: until there is one."""
    try:
        seconds = float(text)
    except ValueError:
        seconds = math.nan
    if not seconds >= 0:
        raise argparse.ArgumentTypeError(f'{text}: expected seconds, 0 or more')
    return seconds


def check(options: argparse.Namespace, for_ros: list[str]) -> None:
    """Refuse, with CannotServe, options that do not go together."""
    alone = next((f'--{key}' for key in ('scene', 'play') if getattr(options, key) is not None), '')
    if options.static is not None and (not alone or for_ros):
        raise CannotServe('--static: expected --scene or --play with it, and nothing of ROS; a '
                          "node's run is recorded first: ros2 bag record")
    if alone and for_ros:
        raise CannotServe(f'{" ".join(for_ros)}: not with {alone}, which does without ROS')
    if options.engine is not None and options.scene is None:
        raise CannotServe(f'--engine {options.engine}: only with --scene')
    if options.start_after is not None and alone:
        raise CannotServe(f'--start-after {options.start_after:g}: not with {alone}, which waits '
                          'for a page as long as it takes')


def serve(options: argparse.Namespace, for_ros: list[str], stop: threading.Event) -> None:
    """Serve the page until told to stop; RagdollError if it cannot be."""
    folder = folder_for_files(options.folder)
    number = free_port(options.host, options.port)
    source = make_source(options, for_ros)
    try:
        Page = page_class()
        with server_at(options.host, number) as server:
            page = Page(server, source, folder)
            page.opening = opening(options, source)
            print(f'The page is at http://{shown(options.host)}:{server.get_port()}', flush=True)
            if is_open(options.host):
                print(OPEN_TO_ALL.format(server.get_port(), folder), file=sys.stderr, flush=True)
            page.run(stop)
    finally:
        source.close()


def folder_for_files(wanted: str | None) -> Path:
    """Where the page keeps files: the ``wanted`` folder, or OWN_FOLDER, made if it is missing, or,
    where that cannot be, one for this run alone; CannotServe if the wanted one cannot be written.
    """
    folder = Path(wanted) if wanted is not None else Path.home() / OWN_FOLDER
    if wanted is None:
        try:
            folder.mkdir(exist_ok=True)
        except OSError as error:
            folder = Path(tempfile.mkdtemp(prefix='ragdolls_'))
            print(f'{error.filename}: {error.strerror}; what the page saves goes to {folder}, '
                  'unless --folder names another', file=sys.stderr)
    if not folder.is_dir() or not os.access(folder, os.W_OK | os.X_OK):
        raise CannotServe(f'--folder {folder}: expected a folder that can be written to')
    return folder


def write_static(options: argparse.Namespace, for_ros: list[str]) -> None:
    """Write the page that needs no server; RagdollError if it cannot be as asked."""
    scene = None if options.scene is None else load_scene(options.scene)
    page_class()
    from .static import fall, save_static
    if scene is not None:
        recording = fall(scene, options.engine or 'auto')
    else:
        from ..recordings.mcap_file import load_recording
        recording = load_recording(options.play)
    path = save_static(recording, options.static)
    print(f'{path}: {recording.duration:.1f} s, {path.stat().st_size / 1e6:.1f} MB')


def page_class() -> type:
    """Import what takes longest, only once all else is as it should be; CannotServe if it fails."""
    try:
        import viser  # noqa: F401
    except ImportError as error:
        raise CannotServe(f'{error}: {NO_VISER}') from None
    from .page import Page
    return Page


def make_source(options: argparse.Namespace, for_ros: list[str]) -> Source:
    """Simulate a scene here, play a run, or listen to a node; RagdollError if that cannot be."""
    if options.play is not None:
        from ..recordings.mcap_file import load_recording
        from .sources.playback import Playback
        return Playback(load_recording(options.play), Path(options.play).name)
    if options.scene is not None:
        scene = load_scene(options.scene)
        from .sources.simulated import Simulated
        return Simulated(scene, options.engine or 'auto')
    try:
        from .sources.node.source import Remote
    except ImportError as error:
        raise CannotServe(f'{error}: {NO_ROS}') from None
    return Remote(for_ros)


def opening(options: argparse.Namespace, source: Source) -> Opening | None:
    """What lets a scene of its own, or a node that waits, go once it is seen; else None."""
    from .start_when_visible import Opening
    if options.scene is not None:
        source.pause(True)
        return Opening(source, None)
    return None if options.start_after is None else Opening(source, options.start_after)


def free_port(host: str, wanted: int | None) -> int:
    """The wanted port, or the first free one from PORT on; CannotServe if there is none."""
    for port in (wanted,) if wanted is not None else range(PORT, PORT + 100):
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
    raise CannotServe(f'--host {host} --port {wanted or PORT}: {reason}; {remedy}')


@contextlib.contextmanager
def server_at(host: str, port: int) -> Iterator[object]:
    """Viser's server, without its own words on standard output.

    At the end it would wait 6 s for each connection on which nothing was asked yet, such as a
    browser keeps in reserve: it is left to itself then.
    """
    import viser
    with contextlib.redirect_stdout(io.StringIO()):
        server = viser.ViserServer(host, port, label='ragdoll', verbose=False)
    try:
        yield server
    finally:
        with contextlib.redirect_stdout(io.StringIO()):
            ending = threading.Thread(target=server.stop, daemon=True)
            ending.start()
            ending.join(ENDING)


def is_open(host: str) -> bool:
    """Whether other machines reach what is served at a host."""
    address = socket.getaddrinfo(host, None, type=socket.SOCK_STREAM)[0][4][0]
    return not ipaddress.ip_address(address.partition('%')[0]).is_loopback


def shown(host: str) -> str:
    """Name by which this machine's browser reaches a host."""
    return {'0.0.0.0': '127.0.0.1', '::': '[::1]'}.get(host, f'[{host}]' if ':' in host else host)


if __name__ == '__main__':
    sys.exit(main())
