"""Sizes of functions and classes: what is larger than the rest stands in docs/architecture.md."""
import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
LINES, CLASS_LINES, PARAMETERS = 45, 250, 8
"""Of a function and of a class, with docstrings; parameters of a function, without self and cls."""


def definitions(node, owner=''):
    """Functions and classes within a node of a syntax tree, each with its full name."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            yield owner + child.name, child
            yield from definitions(child, f'{owner}{child.name}.')
        else:
            yield from definitions(child, owner)


def lines(node):
    return node.end_lineno - node.lineno + 1


def parameters(node):
    names = [one.arg for one in (*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs)]
    return len(names) - (names[:1] in (['self'], ['cls']))


def large(tree):
    """What of a syntax tree is larger than the rest: (kind, name)."""
    for name, node in definitions(tree):
        if isinstance(node, ast.ClassDef):
            if lines(node) > CLASS_LINES:
                yield 'Lines of a class', name
        else:
            if lines(node) > LINES:
                yield 'Lines of a function', name
            if parameters(node) > PARAMETERS:
                yield 'Parameters', name


@pytest.fixture(scope='module')
def stated():
    """Names of the exceptions that the page states, by kind."""
    page = (ROOT / 'docs' / 'architecture.md').read_text()
    section = page.partition('## Sizes')[2].partition('\n## ')[0]
    assert f'at most {LINES} lines and {PARAMETERS} parameters' in section
    assert f'a class at most {CLASS_LINES} lines' in section
    rows = re.findall(r'^\| ([A-Z][a-z ]+) \|(.*)\|$', section, re.M)
    return {(kind, name) for kind, names in rows for name in re.findall(r'`([\w.]+)`', names)}


def test_what_is_large_is_stated(stated):
    found = {one for path in (ROOT / 'ragdoll_ros').rglob('*.py')
             for one in large(ast.parse(path.read_text()))}
    assert found == stated


def test_a_large_function_is_found():
    body = '\n'.join(['    pass'] * LINES)
    assert list(large(ast.parse(f'class A:\n  def f(self, a):\n{body}'))) == [
        ('Lines of a function', 'A.f')]
    assert list(large(ast.parse('def g(a, b, c, d, e, f, g, h, i): pass'))) == [('Parameters', 'g')]
