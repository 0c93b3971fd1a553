"""The worked detector of docs/falls_detector.py, from data sets in files."""
import subprocess
import sys
from pathlib import Path

import pytest
from falls_recipes import SHOVE, recipe

from ragdoll_ros.falls.manifest import build_dataset
from ragdoll_ros.falls.shard import DatasetJob, make_shard

pytest.importorskip('sklearn')
pytest.importorskip('pandas')
SCRIPT = Path(__file__).parents[1] / 'docs/falls_detector.py'
RECORD = {'rate': 100, 'imu_rate': 200, 'imus': [
    {'name': 'low_back', 'bone': 'torso', 'position': [-0.05, 0, -0.15]}]}


def test_a_detector_is_trained_and_tested_on_files(tmp_path):
    """Dolls that are shoved, held in the air, and thrown, which the detector has not seen."""
    held = {**SHOVE, 'name': 'held', 'cause': 'no_fall', 'pushes': [],
            'grabs': [{'bone': 'torso', 'duration': 9}]}
    thrown = {**SHOVE, 'name': 'thrown', 'pushes': [], 'start': {
        'clearance': 0.5, 'velocity': [{'uniform': [1, 2]}, 0, 0]}}
    for data in (SHOVE, held, thrown):
        job = DatasetJob(recipe({**data, 'duration': 1.5, 'record': RECORD}), 6)
        build_dataset(job, tmp_path / data['name'],
                      lambda job, shards: (make_shard(job, shard) for shard in shards))
    table = subprocess.run(
        [sys.executable, SCRIPT, '--train', tmp_path / 'shove', tmp_path / 'held',
         '--test', tmp_path / 'thrown', tmp_path / 'held'],
        check=True, capture_output=True, text=True, timeout=120).stdout
    rows = {row.split(',')[0].strip('| '): row.split('|')[2:5] for row in table.splitlines()[2:]}
    assert int(rows['thrown'][0].strip(' %')) >= 50 and rows['held'][0].strip() == 'no falls'
    # What it was trained on as no fall is none.
    assert rows['held'][1].strip() == '0%'
