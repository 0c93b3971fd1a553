"""Programs in a network of their own, which Linux plays: it ends with them."""
import os
import subprocess
import sys

import pytest
from conftest import ROOT, light


def run_in_network(network, script, timeout):
    """Run a Python script where the shell commands ``network`` have set up a network, which exec
    "$@" at their end; skip the test where there are no namespaces or a command is missing.
    """
    def words(*command):
        return ['unshare', '--net', '--mount', 'sh', '-c', network, 'sh', *command]

    try:
        tried = subprocess.run(words('true'), capture_output=True, text=True)
    except FileNotFoundError as error:
        pytest.skip(f'no network namespaces: {error}')
    if tried.returncode:
        pytest.skip(f'no such network: {tried.stderr.strip()}')
    return subprocess.run(
        words(sys.executable, '-c', script), capture_output=True, text=True, timeout=timeout,
        env={**light(), 'PYTHONPATH': os.pathsep.join([str(ROOT), *sys.path[1:]]),
             'ROS_AUTOMATIC_DISCOVERY_RANGE': 'SUBNET', 'ROS_DOMAIN_ID': '7',
             # One kernel has one /dev/shm: by it nodes would reach each other past the network.
             'FASTDDS_BUILTIN_TRANSPORTS': 'UDPv4'})
