"""A data set is the same bytes whoever makes its shards, in whatever order, however often a run is
ended; what cannot be written ends it in one line.
"""
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from functools import partial
from pathlib import Path

import pytest
import yaml
from conftest import ROOT
from falls_recipes import DROP, file_bytes, recipe

from ragdoll_ros.falls.command import main
from ragdoll_ros.falls.manifest import FILE, Manifest, build_dataset, differences
from ragdoll_ros.falls.pool import make_shards
from ragdoll_ros.falls.shard import FALLS_PER_SHARD, DatasetJob, make_shard
from ragdoll_ros.model.errors import Unreadable

pytest.importorskip('pyarrow')
PATIENCE = 180.0
"""s that a process has for what takes some."""

SHORT = {**DROP, 'duration': 0.2}

COUNT = 3 * FALLS_PER_SHARD - 10
"""Three shards, the last of them shorter."""


@pytest.fixture(scope='module')
def job():
    return DatasetJob(recipe(SHORT), COUNT)


@pytest.fixture(scope='module')
def made(job, tmp_path_factory):
    """Folder of the data set as this process makes it, shard by shard."""
    folder = tmp_path_factory.mktemp('whole') / 'falls'
    build_dataset(job, folder, here)
    return folder


@pytest.fixture(scope='module')
def whole(made):
    """Its files."""
    return file_bytes(made)


@pytest.fixture
def command(tmp_path):
    """Call the command for these falls; keywords as those of Popen."""
    path = tmp_path / 'drops.yaml'
    path.write_text(yaml.safe_dump(SHORT))
    started = []

    def call(*words, before=(), **options):
        started.append(subprocess.Popen(
            [*before, sys.executable, '-m', 'ragdoll_ros.falls.command', str(path), '--count',
             str(COUNT), *map(str, words)], cwd=ROOT, text=True, stdout=subprocess.PIPE,
            stderr=subprocess.PIPE, start_new_session=True, **options))
        return started[-1]
    yield call
    for process in started:
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
            process.communicate()


def here(job, shards):
    """Make shards in this process."""
    return (make_shard(job, shard) for shard in shards)


def backwards(job, shards):
    """Make them in this process, the last one first."""
    return here(job, list(shards)[::-1])


def wait_for_shards(folder, count, process):
    """Wait until a run has so many shards more in its manifest."""
    deadline = time.monotonic() + PATIENCE
    while lines(folder) < count:
        assert process.poll() is None and time.monotonic() < deadline
        time.sleep(0.005)


def lines(folder):
    path = folder / FILE
    return path.read_text().count('\n') if path.exists() else 0


def told(errors):
    """Lines on stderr but for how far it is, and that machine code is being loaded by another."""
    return [line for line in errors.splitlines()
            if 'falls, ' not in line and 'the dynamics' not in line]


def test_the_same_bytes_in_reverse(job, whole, tmp_path):
    build_dataset(job, tmp_path, backwards)
    assert file_bytes(tmp_path) == whole


def test_the_same_bytes_by_two_processes(job, whole, tmp_path):
    build_dataset(job, tmp_path, partial(make_shards, workers=2))
    assert file_bytes(tmp_path) == whole


@pytest.mark.parametrize('times', [1, pytest.param(3, marks=pytest.mark.slow)])
def test_a_run_that_is_killed_ends_with_the_same_bytes(command, tmp_path, times):
    folder, shards = tmp_path / 'falls', 2 * times + 1
    many = ('--count', shards * FALLS_PER_SHARD, '--resume')
    for done in range(times):
        process = command('-o', folder, *many)
        wait_for_shards(folder, 2 + done, process)
        os.kill(process.pid, signal.SIGKILL)
        process.wait(PATIENCE)
        _wait_until_no_process_of(process)
    # What was being written when it ended.
    (folder / 'data/chunk-000/file-002.parquet.part').write_bytes(b'torn')
    with (folder / FILE).open('a') as file:
        file.write('{"shard": 2, "fal')
    process = command('-o', folder, *many, '--workers', 1)
    _, errors = process.communicate(timeout=PATIENCE)
    assert process.returncode == 0, errors
    build_dataset(DatasetJob(recipe(SHORT), shards * FALLS_PER_SHARD), tmp_path / 'whole', here)
    assert file_bytes(folder) == file_bytes(tmp_path / 'whole')


def _wait_until_no_process_of(leader):
    """Workers end with who started them."""
    deadline = time.monotonic() + PATIENCE
    while True:
        try:
            os.killpg(leader.pid, 0)
        except ProcessLookupError:
            return
        assert time.monotonic() < deadline, 'workers outlive who started them'
        time.sleep(0.01)


def test_ctrl_c_ends_the_run_in_one_line(command, tmp_path):
    folder = tmp_path / 'falls'
    process = command('-o', folder, '--count', 1000 * FALLS_PER_SHARD)
    wait_for_shards(folder, 2, process)
    # As a terminal does it: to all processes of the run.
    os.killpg(process.pid, signal.SIGINT)
    _, errors = process.communicate(timeout=PATIENCE)
    assert process.returncode == 130
    line, = told(errors)
    assert '--resume continues' in line and Manifest.read(folder).done >= FALLS_PER_SHARD
    _wait_until_no_process_of(process)


def test_what_is_torn_is_made_again(job, made, whole, tmp_path):
    folder, again = tmp_path / 'falls', []
    shutil.copytree(made, folder)
    (folder / 'data/chunk-000/file-001.parquet').write_bytes(b'PAR1')
    (folder / 'meta/episodes/chunk-000/file-002.parquet').unlink()

    def watched(job, shards):
        again.extend(shards)
        return here(job, again)
    build_dataset(job, folder, watched, resume=True)
    assert again == [1, 2] and file_bytes(folder) == whole


def test_more_falls_keep_those_that_are_there(job, tmp_path):
    build_dataset(DatasetJob(recipe(SHORT), FALLS_PER_SHARD + 1), tmp_path, here)
    made = []

    def watched(job, shards):
        made.extend(shards)
        return here(job, made)
    build_dataset(job, tmp_path, watched, resume=True)
    # The second shard had one fall only.
    assert made == [1, 2]


def test_other_falls_are_not_mixed(job, tmp_path):
    build_dataset(DatasetJob(recipe(), 1), tmp_path, here)
    before = file_bytes(tmp_path)
    with pytest.raises(Unreadable, match='resume'):
        build_dataset(DatasetJob(recipe(), 1), tmp_path, here)
    with pytest.raises(Unreadable, match='recipe'):
        build_dataset(DatasetJob(recipe(seed=1), 1), tmp_path, here, resume=True)
    assert file_bytes(tmp_path) == before
    build_dataset(DatasetJob(recipe(), 2), tmp_path, here, resume=True)
    with pytest.raises(Unreadable, match='2 or more'):
        build_dataset(DatasetJob(recipe(), 1), tmp_path, here, resume=True)


def test_resuming_other_falls_says_what_differs(tmp_path):
    base = {'name': 'thrown', 'start': {'clearance': {'uniform': [0.1, 0.5]}}}
    build_dataset(DatasetJob(recipe(**base), 1), tmp_path, here)
    other = recipe(name='thrown', seed=3, duration=0.7, feet=['ball'],
                   start={'clearance': {'uniform': [0.1, 0.6]}})
    with pytest.raises(Unreadable) as refused:
        build_dataset(DatasetJob(other, 1, 'amass'), tmp_path, here, resume=True)
    head, *told = str(refused.value).splitlines()
    assert head.endswith('falls of the same recipe; these differ:')
    assert sorted(line.strip() for line in told) == [
        'format: "lerobot" there, "amass" now', 'recipe.duration: 0.6 there, 0.7 now',
        'recipe.feet: [] there, ["ball"] now', 'recipe.seed: 0 there, 3 now',
        'recipe.start.clearance.uniform[1]: 0.5 there, 0.6 now']


def test_differences_name_keys_that_only_one_has():
    old, new = {'a': {'b': 1, 'c': [1, 2]}, 'd': 0}, {'a': {'b': 1, 'e': None}, 'd': [0]}
    assert list(differences(old, new)) == [
        ('a.c', '[1, 2]', 'nothing'), ('a.e', 'nothing', 'null'), ('d', '0', '[0]')]


def test_a_worker_that_is_killed_costs_its_shards_time(job, whole, tmp_path):
    killed = []

    def killing(job, shards):
        for shard in make_shards(job, shards, workers=1):
            if not killed:
                killed.append(_workers()[0])
                os.kill(killed[0], signal.SIGKILL)
            yield shard
    manifest = build_dataset(job, tmp_path, killing)
    assert killed and manifest.done == COUNT and file_bytes(tmp_path) == whole


def _workers():
    """Processes that this one has started and that make shards."""
    found = []
    for path in Path('/proc/self/task').glob('*/children'):
        for child in path.read_text().split():
            words = Path(f'/proc/{child}/cmdline').read_bytes()
            if b'spawn_main' in words:
                found.append(int(child))
    return found


def test_a_failed_fall_is_kept_with_its_reason(tmp_path):
    import pyarrow.parquet as parquet
    job = DatasetJob(recipe(), 3)
    # A speed that no recipe may have: the fall ends as it begins.
    job.recipe.data['start']['velocity'] = [1e12, 0.0, 0.0]
    manifest = build_dataset(job, tmp_path, here)
    assert set(manifest.failures) == {0, 1, 2} and manifest.done == 3
    episodes = parquet.read_table(tmp_path / 'meta/episodes/chunk-000/file-000.parquet')
    assert episodes.column('failure').to_pylist() == list(manifest.failures.values())
    assert json.loads((tmp_path / 'meta/info.json').read_text())['total_episodes'] == 3


FULL = """
mount -t tmpfs -o size=250k tmpfs "$1" || exit 77
shift
"$@" && exit 1
mount -o remount,size=100m "$(dirname "$0")" || exit 78
"$@" --resume || exit 2
cp -r "$(dirname "$0")" "$(dirname "$0").kept"
"""
"""On a file system that is full, then, with more room, to the end."""


def test_a_full_disk_ends_the_run_in_one_line_and_it_goes_on_when_there_is_room(
        whole, command, tmp_path):
    folder = tmp_path / 'small'
    folder.mkdir()
    own = ['unshare', '--mount', 'sh', '-c', FULL, str(folder / 'x'), str(folder)]
    process = command('-o', folder / 'falls', '--workers', 1, before=own)
    _, errors = process.communicate(timeout=PATIENCE)
    if process.returncode in (1, 77) and 'mount' in errors:
        pytest.skip('no file system can be mounted here')
    assert process.returncode == 0, errors
    line, = told(errors)
    assert 'No space left on device' in line and '--resume continues' in line
    assert file_bytes(tmp_path / 'small.kept/falls') == whole


def test_the_command_says_what_it_made(command, tmp_path):
    process = command('-o', tmp_path / 'falls', '--workers', 1)
    out, errors = process.communicate(timeout=PATIENCE)
    assert process.returncode == 0 and told(errors) == []
    assert out.startswith(f'{COUNT} falls in {tmp_path}/falls, ')
    assert Manifest.read(tmp_path / 'falls').done == COUNT


@pytest.mark.parametrize(('words', 'told'), [
    (['--count', '0'], 'count'), (['--workers', 'many'], '--workers'),
    (['--format', 'xml'], '--format'), (['-o', '/proc/nowhere'], '/proc/nowhere')])
def test_a_wrong_call_says_why(capsys, tmp_path, words, told):
    path = tmp_path / 'drops.yaml'
    path.write_text(yaml.safe_dump(SHORT))
    code = exit_code([str(path), '--count', str(COUNT), '-o', str(tmp_path / 'falls'), *words])
    assert code in (1, 2) and told in capsys.readouterr().err


def exit_code(words):
    """What the command ends with."""
    try:
        return main(words)
    except SystemExit as ended:
        return ended.code


def test_a_recipe_with_five_errors_names_them_all(capsys, tmp_path):
    path = tmp_path / 'broken.yaml'
    path.write_text("""who: {dolls: [nobody]}
duration: -3
accuracy: perfect
ground: {friction: {uniform: [1, -1]}}
start: {lean_deg: {normal: [1, 2]}}
""")
    assert exit_code([str(path), '-o', str(tmp_path / 'falls')]) == 2
    said = capsys.readouterr()
    assert said.out == ''
    assert said.err.startswith(f'{path}: 5 errors') and not (tmp_path / 'falls').exists()
    for word in ('nobody', 'duration', 'accuracy', 'friction', 'lean_deg'):
        assert word in said.err
