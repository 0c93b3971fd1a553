"""CPU of the viewers of several versions, all on one node at the same time, relative to the first.

    git worktree add /tmp/before COMMIT
    python test/page_versions.py /tmp/before . --dolls 50

Shares of a core vary by half with what else the machine does; these ratios by a twentieth.
"""
from __future__ import annotations

import argparse
import os
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import rclpy
from page_client import PageClient, wait
from page_cost import cpu, spinning
from peer import free_domain, kill, start


def viewer_of(folder: Path) -> tuple[subprocess.Popen, PageClient]:
    """Start the viewer of a checkout, and look at it."""
    viewer = subprocess.Popen(
        [sys.executable, '-m', 'ragdoll_ros.viewer.command', '--port', '0'],
        stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, cwd=folder,
        env=os.environ | {'PYTHONPATH': str(folder)})
    client = PageClient(int(re.search(r':(\d+)\n', viewer.stdout.readline())[1]))
    wait(lambda: client.windows > 60, timeout=60)
    return viewer, client


def measure(viewers: list[subprocess.Popen], seconds: float) -> np.ndarray:
    """Shares of one core."""
    before, begun = [cpu(viewer) for viewer in viewers], time.monotonic()
    time.sleep(seconds)
    return (np.array([cpu(viewer) for viewer in viewers]) - before) / (time.monotonic() - begun)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('folders', nargs='+', type=Path, help='checkouts, the first for comparison')
    parser.add_argument('--dolls', type=int, default=1, help='that spin (1)')
    parser.add_argument('--scene', help='a shipped scene instead')
    parser.add_argument('--rounds', type=int, default=4)
    parser.add_argument('--seconds', type=float, default=8.0, help='of each round (8)')
    options = parser.parse_args()
    domain, lock = free_domain()
    os.environ['ROS_DOMAIN_ID'] = str(domain)
    rclpy.init(args=[])
    with tempfile.TemporaryDirectory() as folder:
        scene = options.scene or spinning(options.dolls, Path(folder) / 'spinning.yaml')
        node, opened = start('node', '--ros-args', '-p', f'scene:={scene}', compiled=True), []
        try:
            for checkout in options.folders:
                opened.append(viewer_of(checkout.resolve()))
            shares = []
            for _ in range(options.rounds):
                shares.append(measure([viewer for viewer, _ in opened], options.seconds))
                print('shares of a core', shares[-1].round(4), flush=True)
            print('ratios', np.median(np.array(shares) / np.array(shares)[:, :1], axis=0).round(2))
        finally:
            for viewer, client in opened:
                client.close()
                viewer.kill()
                viewer.communicate()
            kill(node)
    rclpy.try_shutdown()
    lock.close()


if __name__ == '__main__':
    main()
