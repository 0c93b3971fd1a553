"""The other side of a running node: listens, sends, calls and waits for conditions."""
from __future__ import annotations

import contextlib
import fcntl
import os
import pty
import signal
import struct
import subprocess
import sys
import tempfile
import termios
import threading
import time
from pathlib import Path

from conftest import light
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

PATIENCE = 180.0
"""s that a condition may take: discovery alone takes up to 3 s, up to 10 on a busy machine, where
what comes 100 times a second on many topics is heard some 10 s late as well."""


DOMAINS = 100
"""Domain ids, from 1 on, that leave room for ports."""

LOCKS: list = []
"""The lock of this session's domain; processes inherit it, so that none outlives it unseen."""

STARTED: list[subprocess.Popen] = []
"""All processes that were started."""


def free_domain():
    """Give a domain id that no test session or process of one on this machine has, and its lock."""
    for number in range(DOMAINS):
        domain = 1 + (os.getpid() + number) % DOMAINS
        path = Path(tempfile.gettempdir()) / f'ragdoll_ros_test_domain_{domain}'
        lock = path.open('w')
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            lock.close()
            continue
        LOCKS.append(lock)
        return domain, lock
    raise RuntimeError(f'no ROS domain from 1 to {DOMAINS} is free')


class Peer(Node):
    """A node of the tests' process, with an executor of its own."""

    def __init__(self, name='peer'):
        super().__init__(name)
        self.executor_ = SingleThreadedExecutor()
        self.executor_.add_node(self)
        self._callers = {}

    def collect(self, kind, topic, qos=1000):
        """Subscribe; give the list that messages go to, each as (arrival s, message)."""
        got = []
        self.create_subscription(kind, topic, lambda m: got.append((time.monotonic(), m)), qos)
        return got

    def hear_once(self, kind, topic):
        """The first message that comes on a topic from now on."""
        got = []
        subscription = self.create_subscription(kind, topic, got.append, 10)
        self.wait(lambda: got)
        self.destroy_subscription(subscription)
        return got[0]

    def wait(self, condition, timeout=PATIENCE):
        """Spin until the condition holds; fail if it does not in time."""
        end = time.monotonic() + timeout
        while not condition():
            assert time.monotonic() < end, 'not in time'
            self.executor_.spin_once(timeout_sec=0.1)

    def wait_heard(self, node, *topics):
        """Spin until all that a node publishes on these topics has a subscriber."""
        publishers = [publisher for publisher in node.publishers if publisher.topic_name in topics]
        assert len(publishers) == len(topics)
        self.wait(lambda: all(publisher.get_subscription_count() for publisher in publishers))

    def sender(self, kind, topic):
        """Publisher that a subscriber listens to already."""
        publisher = self.create_publisher(kind, topic, 10)
        self.wait(lambda: publisher.get_subscription_count() > 0)
        return publisher

    def call(self, kind, name, request):
        """Call a service and give its answer."""
        if name not in self._callers:
            self._callers[name] = self.create_client(kind, name)
        self.wait(self._callers[name].service_is_ready)
        future = self._callers[name].call_async(request)
        self.wait(future.done)
        return future.result()


@contextlib.contextmanager
def listening():
    """A peer that spins in a thread of its own: what it notes is when a message came."""
    peer = Peer()
    thread = threading.Thread(target=peer.executor_.spin, daemon=True)
    thread.start()
    yield peer
    peer.executor_.shutdown()
    thread.join()
    peer.destroy_node()


def start(module, *arguments, terminal=None, compiled=False):
    """Start a module of the ROS side as a process; ``terminal``: on that pty's end."""
    command = [sys.executable, '-m', f'ragdoll_ros.ros.{module}', *arguments]
    keys = subprocess.DEVNULL if terminal is None else terminal
    STARTED.append(subprocess.Popen(
        command, stdin=keys, stdout=subprocess.PIPE if terminal is None else terminal,
        stderr=subprocess.PIPE, text=True, start_new_session=True,
        env=dict(os.environ) if compiled else light(), pass_fds=[lock.fileno() for lock in LOCKS]))
    return STARTED[-1]


def start_on_terminal(module, *arguments):
    """Start a module on a terminal of its own; also give the side that types and reads."""
    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack('4H', 24, 120, 0, 0))
    process = start(module, *arguments, terminal=theirs)
    os.close(theirs)
    os.set_blocking(ours, False)
    return process, ours


def kill(process):
    """Kill a process and those that it has started, if it still runs."""
    if process.poll() is None:
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()


def end(process, sign, timeout=PATIENCE):
    """Send a signal; give the exit code and the seconds it took."""
    before = time.monotonic()
    process.send_signal(sign)
    _, process.stderr_text = process.communicate(timeout=timeout)
    return process.returncode, time.monotonic() - before
