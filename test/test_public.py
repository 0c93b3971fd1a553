"""The public names: what an editor, a type checker and help() show of them."""
import ast
import doctest
import importlib
import inspect
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
import typed_client

import ragdoll_ros

ROOT = Path(__file__).resolve().parent.parent
NAMES = {name: getattr(ragdoll_ros, name) for name in ragdoll_ros.__all__}


def static_imports():
    """Module of each name that __init__.py imports under TYPE_CHECKING, and its alias."""
    tree = ast.parse((ROOT / 'ragdoll_ros/__init__.py').read_text())
    block = next(node for node in tree.body
                 if isinstance(node, ast.If) and ast.unparse(node.test) == 'TYPE_CHECKING')
    return [(node.module, alias.name, alias.asname) for node in block.body for alias in node.names]


def test_static_imports_are_the_lazy_names():
    """The same object under the same name; `as` marks it as public (PEP 484)."""
    found = static_imports()
    assert sorted(name for _, name, _ in found) == sorted(ragdoll_ros.__all__)
    for module, name, alias in found:
        assert alias == name
        home = importlib.import_module(f'ragdoll_ros.{module}')
        assert getattr(home, name) is getattr(ragdoll_ros, name)
        assert not hasattr(NAMES[name], '__module__') or NAMES[name].__module__ == home.__name__


def test_a_wrong_name_lists_the_right_ones():
    with pytest.raises(AttributeError, match="no 'Simulator', but: Bone, Box"):
        ragdoll_ros.Simulator  # noqa: B018
    assert set(ragdoll_ros.__all__) <= set(dir(ragdoll_ros))


@pytest.mark.parametrize('name', [name for name in NAMES if name != 'RagdollError'])
def test_a_docstring_says_what_each_argument_is(name):
    arguments = re.search(r'^Args:\n((?:    .*\n)+)', inspect.getdoc(NAMES[name]) + '\n', re.M)
    described = {part for words in re.findall(r'^    (\w[\w, ]*):', arguments[1], re.M)
                 for part in words.split(', ')} if arguments else set()
    assert described == set(inspect.signature(NAMES[name]).parameters)


@pytest.mark.parametrize('name', NAMES)
def test_the_example_of_a_docstring_runs(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    example, = doctest.DocTestFinder(recurse=False).find(NAMES[name], name, globs=dict(NAMES))
    assert example.examples
    said = []
    doctest.DocTestRunner().run(example, out=said.append)
    assert not said, ''.join(said)


def test_a_typed_client_uses_every_public_name(tmp_path):
    used = {node.id for node in ast.walk(ast.parse(Path(typed_client.__file__).read_text()))
            if isinstance(node, ast.Name)}
    assert used >= set(ragdoll_ros.__all__)
    typed_client.main(tmp_path)


def test_a_typed_client_is_clean_under_mypy_strict(tmp_path):
    """As from an installed package, whose types mypy reads only where it finds py.typed."""
    pytest.importorskip('mypy')
    done = subprocess.run(
        [sys.executable, '-m', 'mypy', '--strict', '--config-file=', '--cache-dir',
         str(ROOT / '.mypy_cache/client'), typed_client.__file__],
        cwd=tmp_path, env={**os.environ, 'PYTHONPATH': str(ROOT)}, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


def test_the_modules_of_the_public_names_are_type_checked():
    """By `make lint`."""
    table = (ROOT / 'pyproject.toml').read_text().partition('[tool.mypy]')[2]
    files = re.findall(r'"(ragdoll_ros/.*?)"', table)
    homes = {f'ragdoll_ros/{module.replace(".", "/")}.py' for module, _, _ in static_imports()}
    assert set(files) >= homes
