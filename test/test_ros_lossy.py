"""A network that loses packets: the page lacks no tick, as what is lost is sent again."""
import itertools
import json

import pytest
from network_namespace import run_in_network

SECONDS = 30

NETWORK = """
set -e
ip link set lo up
ip link set lo multicast on
ip route add 224.0.0.0/4 dev lo
nft add table ip lossy
nft 'add chain ip lossy input { type filter hook input priority 0; }'
nft 'add rule ip lossy input udp dport 1-65535 numgen random mod 1000 < 200 drop'
exec "$@"
"""
"""In a namespace of its own, a fifth of all packets is lost; all is gone with it."""

PAGE = f"""
import json, subprocess, sys, time
from ragdoll_ros.viewer.sources.node.source import NodeSource
from ragdoll_ros.viewer.sources.source import RequestedData

node = subprocess.Popen([sys.executable, '-m', 'ragdoll_ros.ros.node', '--ros-args',
                         '-p', 'scene:=flight'], stderr=subprocess.DEVNULL)
source, frames = NodeSource([]), []
try:
    source.request(RequestedData(frames=True))
    end = time.monotonic() + 120
    while len(frames) < {SECONDS} * 100 and time.monotonic() < end:
        frames += source.take_frames()
        time.sleep(1 / 60)
    print(json.dumps([[frame.run, frame.time] for frame in frames]), flush=True)
finally:
    node.terminate()
    node.wait(20)
    source.close()
"""


@pytest.mark.slow
def test_no_tick_is_lost_where_a_fifth_of_all_packets_is():
    """With ten messages to send again, some ten of 6 000 ticks were."""
    done = run_in_network(NETWORK, PAGE, timeout=300)
    assert done.stdout, done.stderr
    frames = json.loads(done.stdout)
    assert len(frames) >= SECONDS * 100 and {run for run, _ in frames} == {frames[0][0]}
    steps = [after - before for (_, before), (_, after) in itertools.pairwise(frames)]
    assert max(steps) == pytest.approx(0.01), done.stderr
