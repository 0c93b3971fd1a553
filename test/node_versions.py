"""CPU of the nodes of several versions, measured at the same time, relative to the first.

    git worktree add /tmp/before COMMIT
    python test/node_versions.py /tmp/before . --page

All nodes share one core, as the cost of a message depends on which cores its two threads have;
viewers and pages have the others. Shares of a core vary by half with what else the machine does,
these ratios by a twentieth. Scenes are read by all versions, so without the keys of the last.
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
from page_client import PageClient, wait
from page_cost import cpu, spinning
from peer import free_domain


def start(folder: Path, module: str, arguments: list[str], cores: set[int],
          domain: int) -> subprocess.Popen:
    """Start a module of a checkout in a ROS domain of its own."""
    process = subprocess.Popen(
        [sys.executable, '-m', f'ragdoll_ros.{module}', *arguments], cwd=folder,
        stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
        env=os.environ | {'PYTHONPATH': str(folder), 'ROS_DOMAIN_ID': str(domain),
                          'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST'})
    os.sched_setaffinity(process.pid, cores)
    return process


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('folders', nargs='+', type=Path, help='checkouts, the first for comparison')
    parser.add_argument('--scene', default='drop', help="or 'spinning', in free space (drop)")
    parser.add_argument('--page', action='store_true', help='a viewer with a page on each node')
    parser.add_argument('--settle', type=float, default=15.0, help='s before the first round (15)')
    parser.add_argument('--rounds', type=int, default=7)
    parser.add_argument('--seconds', type=float, default=4.0, help='of each round (4)')
    options = parser.parse_args()
    cores, nodes, others, clients = sorted(os.sched_getaffinity(0)), [], [], []
    with tempfile.TemporaryDirectory() as temporary:
        scene = options.scene
        if scene == 'spinning':
            path = spinning(1, Path(temporary) / 'spinning.yaml')
            text = path.read_text('utf-8')
            path.write_text(re.sub(r'^description:.*\n', '', text, flags=re.MULTILINE), 'utf-8')
            scene = str(path)
        try:
            for folder in map(Path.resolve, options.folders):
                domain, _ = free_domain()
                nodes.append(start(folder, 'ros.node', ['--ros-args', '-p', f'scene:={scene}'],
                                   {cores[0]}, domain))
                if options.page:
                    others.append(start(folder, 'viewer.command', ['--port', '0'],
                                        set(cores[1:] or cores), domain))
                    line = others[-1].stdout.readline()
                    clients.append(PageClient(int(re.search(r':(\d+)\n', line)[1])))
                    wait(lambda: clients[-1].windows > 20)
            time.sleep(options.settle)
            shares = []
            for _ in range(options.rounds):
                before, begun = [cpu(node) for node in nodes], time.monotonic()
                received = [client.bytes for client in clients]
                time.sleep(options.seconds)
                elapsed = time.monotonic() - begun
                shares.append((np.array([cpu(node) for node in nodes]) - before) / elapsed)
                rates = [(client.bytes - had) / elapsed / 1e3
                         for client, had in zip(clients, received, strict=True)]
                print('shares of a core', shares[-1].round(4), 'kB/s', np.round(rates, 1),
                      flush=True)
            print('ratios', np.median(np.array(shares) / np.array(shares)[:, :1], axis=0).round(2))
        finally:
            for client in clients:
                client.close()
            for process in (*nodes, *others):
                process.kill()
                process.communicate()


if __name__ == '__main__':
    main()
