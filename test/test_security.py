"""What the code does with what comes from outside, read from the code."""
import ast
import functools
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = ROOT / 'ragdoll_ros'

EVALUATORS = {'eval', 'exec', 'compile', '__import__', 'os.system', 'os.popen'}
LOADERS = {'pickle', 'cPickle', 'marshal', 'shelve', 'dill', 'joblib', 'cloudpickle'}
UNSAFE_YAML = {'load', 'load_all', 'unsafe_load', 'full_load', 'Loader', 'UnsafeLoader',
               'FullLoader', 'CLoader', 'CUnsafeLoader', 'unsafe_load_all', 'full_load_all'}
OWN = 'physics/kernels/compiling/cache.py'
"""Unpickles machine code that the same user has kept."""

WRITERS = {
    'accuracy/report/command.py': '--out', 'accuracy/results/figures.py': '--out',
    'accuracy/report/plots.py': '--out',
    'accuracy/report/many_starts.py': '--out', 'accuracy/peers/quickstart.py': 'a temporary file',
    'falls/describe.py': '--out', 'falls/manifest.py': '--out', 'falls/pictures.py': '--out',
    'files/doll.py': 'save_doll(path)', 'files/scene.py': 'save_scene(path)',
    'fit/command.py': '--out, --urdf', 'fit/picture.py': '--picture',
    'physics/engine/substepped/bullet.py': 'a temporary file',
    'physics/engine/substepped/silence.py': 'os.devnull',
    'physics/kernels/compiling/cache.py': 'machine code, NUMBA_CACHE_DIR',
    'recordings/save.py': '--save, save_recording(path)', 'viewer/static.py': '--static',
    'ros/tools/crowd_bench.py': 'a temporary file', 'ros/recovery.py': 'dump_directory',
    'viewer/command.py': '~/ragdolls',
    'viewer/editor/scene_folder.py': '--folder, ~/ragdolls'}
"""Files that write files, and what says where."""


@functools.cache
def syntax(path):
    """Syntax tree of a file."""
    return ast.parse(path.read_text())


def calls(path):
    """Calls in a file: what is called, its last name and the call."""
    for node in ast.walk(syntax(path)):
        if isinstance(node, ast.Call):
            name = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(
                node.func, 'id', '')
            yield ast.unparse(node.func), name, node


def writes(called, name, call):
    """Whether a call makes or changes a file."""
    if name in ('write_text', 'write_bytes', 'mkdir', 'makedirs', 'savefig', 'savez', 'touch',
                'unlink', 'symlink_to', 'rmtree', 'copyfile', 'tofile'):
        return True
    if called in ('os.open', 'np.save', 'np.savetxt', 'shutil.copy', 'shutil.move'):
        return True
    if name == 'open':
        given = [*call.args, *(each.value for each in call.keywords if each.arg == 'mode')]
        return any(isinstance(each, ast.Constant) and isinstance(each.value, str)
                   and each.value.strip('rwxabt+') == '' and set(each.value) & set('wxa+')
                   for each in given)
    return False


def sources():
    return {path.relative_to(PACKAGE).as_posix(): path for path in PACKAGE.rglob('*.py')}


@pytest.mark.parametrize('code, found', [
    ("open(p, 'w')", True), ("p.open('xb')", True), ("open(p, mode='a')", True), ('open(p)', False),
    ("p.open('rb')", False), ('p.write_text(t)', True), ("open('w.txt')", False)])
def test_what_counts_as_writing(tmp_path, code, found):
    (tmp_path / 'code.py').write_text(code)
    assert any(writes(*call) for call in calls(tmp_path / 'code.py')) is found


def imported(path):
    """Modules that a file imports, by the first part of their names."""
    for node in ast.walk(syntax(path)):
        if isinstance(node, ast.Import):
            yield from (alias.name.split('.')[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            yield node.module.split('.')[0]


def runs_what_it_is_given(called, name, call):
    """Whether a call may run what is in its arguments; a number that stands there is no input."""
    if [ast.unparse(each) for each in call.args] == ["'0'"] and not call.keywords:
        return False
    asked = [each.arg for each in call.keywords if ast.unparse(each.value) != 'False']
    if called in EVALUATORS or 'allow_pickle' in asked or 'shell' in asked:
        return True
    return called.startswith('yaml.') and name in UNSAFE_YAML and '_Loader' not in map(
        ast.unparse, (*call.args, *(each.value for each in call.keywords)))


@pytest.mark.parametrize('code, found', [
    ('eval(t)', True), ("eval('0')", False), ("eval('0', t)", True), ('os.system(t)', True),
    ('yaml.load(t, yaml.Loader)', True),
    ('np.load(p, allow_pickle=True)', True), ('np.load(p, allow_pickle=False)', False),
    ('yaml.load(t, _Loader)', False),
    ('re.compile(t)', False), ('yaml.safe_load(t)', False)])
def test_what_counts_as_running(tmp_path, code, found):
    (tmp_path / 'code.py').write_text(code)
    assert any(runs_what_it_is_given(*call) for call in calls(tmp_path / 'code.py')) is found


def test_nothing_is_evaluated_or_unpickled_from_input():
    assert not [f'{name}:{call[2].lineno}' for name, path in sources().items()
                for call in calls(path) if runs_what_it_is_given(*call)]
    assert {name for name, path in sources().items() if LOADERS & {*imported(path)}} == {OWN}


def test_our_yaml_loader_builds_no_objects():
    from ragdoll_ros.files import yaml_text
    with pytest.raises(yaml_text.yaml.YAMLError):
        yaml_text.yaml.load('!!python/object/apply:os.getcwd []', yaml_text._Loader)


def test_files_are_written_only_where_somebody_says():
    found = {name for name, path in sources().items() if any(writes(*call) for call in calls(path))}
    assert found == set(WRITERS)
