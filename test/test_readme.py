"""README.md, CONTRIBUTING.md and docs/ say what is: their code runs, their commands exist."""
import contextlib
import dataclasses
import functools
import importlib
import importlib.util
import io
import json
import os
import re
import runpy
import shlex
import tempfile
from pathlib import Path

import numpy as np
import pytest

import ragdoll_ros
from ragdoll_ros.falls import generate, load_recipe
from ragdoll_ros.falls.formats.registry import FORMATS
from ragdoll_ros.fit.command import main as fit_main

ROOT = Path(__file__).resolve().parent.parent
WRITTEN_BY_PROGRAMS = {'docs/accuracy.md', 'docs/starts/accuracy.md'}
PAGES = {name: path.read_text() for path in [
    *(ROOT / f'{name}.md' for name in ('README', 'CONTRIBUTING', 'QUALITY_DECLARATION')),
    *sorted(ROOT.glob('docs/**/*.md'))]
    if (name := path.relative_to(ROOT).as_posix()) not in WRITTEN_BY_PROGRAMS}

SETUP = (ROOT / 'setup.py').read_text()
EXECUTABLES = dict(re.findall(r"'(ragdoll_\w+)': '([\w.]+):main'", SETUP))
EXTRAS = dict(re.findall(r"^        '(\w+)': \[(.*?)\]", SETUP, re.M | re.S))
MAKEFILE = (ROOT / 'Makefile').read_text()
TARGETS = set(re.findall(r'^([a-z-]+):.*## ', MAKEFILE, re.M))

OURS = ('make', 'pip', 'python', 'python3', 'ros2', *EXECUTABLES)
"""Programs whose calls are looked at."""

FOREIGN = {'apt', 'colcon', 'docker', 'export', 'git', 'pre-commit', 'rosdep', 'rviz2', 'source',
           'ssh'}
"""Programs that are neither ours nor called with anything of ours."""


def blocks(kind):
    """Fenced blocks of a kind, each with the page it stands on."""
    block = re.compile(rf'^```{kind}\n(.*?)^```', re.M | re.S)
    found = [pytest.param(text, id=f'{name}:{number}') for name, page in PAGES.items()
             for number, text in enumerate(block.findall(page))]
    assert found, kind
    return found


def commands():
    """What is to be typed: lines of shell blocks, and what stands in the text as code."""
    for name, page in PAGES.items():
        lines = [line for text in re.findall(r'^```sh\n(.*?)^```', page, re.M | re.S)
                 for line in text.replace('\\\n', '').splitlines()]
        prose = re.sub(r'^```.*?^```', '', page, flags=re.M | re.S)
        lines += [code for code in re.findall(r'`([^`\n]+)`', prose)
                  if re.match(rf'(\S+=\S+ )*(\.venv/bin/)?({"|".join(OURS)}) ', code)]
        yield from (pytest.param(line, id=f'{name}: {line}') for line in dict.fromkeys(lines))


def words_of(line):
    """Words of a command without what is set before it."""
    words = shlex.split(line, comments=True)
    while words and (words[0] == 'sudo' or re.fullmatch(r'[A-Z_]+=\S*', words[0])):
        words.pop(0)
    return [words[0].removeprefix('.venv/bin/'), *words[1:]] if words else ['source']


@functools.cache
def run(text):
    """Names that a block of Python leaves, and what it has `printed`; its files are nobody's."""
    names, printed, here = {'__name__': 'block'}, io.StringIO(), Path.cwd()
    with contextlib.redirect_stdout(printed), tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        try:
            exec(compile(text, 'block', 'exec'), names)
        finally:
            os.chdir(here)
    return {**names, 'printed': printed.getvalue()}


def first(page):
    """The first block of Python on a page."""
    return re.search(r'^```python\n(.*?)^```', PAGES[page], re.M | re.S)[1]


def experiment(title):
    """The block of Python below a title of docs/teaching.md."""
    section = PAGES['docs/teaching.md'].split(f'## {title}\n')[1].split('\n## ')[0]
    return re.search(r'^```python\n(.*?)^```', section, re.M | re.S)[1]


def table(page, title):
    """First cell of each row of the table below a title."""
    section = re.split(rf'^##+ {title}\n', PAGES[page], flags=re.M)[1].split('\n## ')[0]
    return re.findall(r'^\| (`.*?) \|', section, re.M)


def coded(cells):
    return {name for cell in cells for name in re.findall('`(.*?)`', cell)}


@pytest.mark.parametrize('text', blocks('python'))
def test_python_runs_as_it_stands(text):
    assert run(text)


def test_python_of_the_readme_lets_a_doll_fall():
    names = run(first('README.md'))
    state = names['state']
    assert state.positions.shape == (10, 3) and state.orientations.shape == (10, 4)
    assert names['simulation'].time == 1_000_000_000
    assert state.positions[names['head'], 0] > 1, 'pushed forwards'
    assert 0.05 < state.positions[names['head'], 2] < 0.5, 'lies on the ground'
    np.testing.assert_allclose(np.linalg.norm(state.orientations, axis=1), 1, atol=1e-12)
    assert 'energy_excess_J' in names['printed']


def test_python_of_the_library_page_gives_states():
    states = run(first('docs/python.md'))['states']
    assert len(states) == 300 and not np.array_equal(states[0].positions, states[-1].positions)


def test_library_page_names_what_the_library_gives():
    cells = table('docs/python.md', 'Names')
    assert {text.split('(')[0] for text in coded(cells)} == set(ragdoll_ros.__all__)
    fields = coded(table('docs/python.md', 'Push'))
    assert fields == set(ragdoll_ros.Push.__dataclass_fields__)
    with ragdoll_ros.Simulation(ragdoll_ros.load_scene('flight')) as simulation:
        for cell in table('docs/python.md', 'Simulation'):
            name = re.match(r'`(\w+)', cell)[1]
            assert name == 'Simulation' or hasattr(simulation, name), name
        for cell in table('docs/python.md', 'State'):
            assert hasattr(simulation.advance(), re.match(r'`(\w+)', cell)[1]), cell


def test_free_fall_is_right_to_rounding():
    assert run(experiment('Free fall'))['error'] < 1e-12


def test_momentum_is_that_of_the_push():
    names = run(experiment('Momentum'))
    np.testing.assert_allclose(names['momentum'], (60, 0, 0), atol=1e-9)
    assert names['measures']['work_of_pushes_J'] == pytest.approx(172, abs=1)
    assert names['measures']['energy_excess_J'] == pytest.approx(-110, abs=1)


def test_finer_steps_bend_joints_less():
    printed = run(experiment('Step size'))['printed']
    rows = [line.split() for line in printed.splitlines()]
    assert [row[0] for row in rows] == ['draft', 'normal', 'exact']
    substeps, overshoot = [float(row[1]) for row in rows], [float(row[3]) for row in rows]
    assert substeps == sorted(substeps) and overshoot == sorted(overshoot, reverse=True)


def test_falls_part_at_the_touch():
    apart = run(experiment('Chaos'))['apart']
    assert apart[27] < 2e-5 and apart[39] > 0.01 and apart[99] > 0.1


@pytest.mark.parametrize('text', blocks('yaml'))
def test_yaml_is_a_scene_a_doll_a_recipe_or_limits(tmp_path, text):
    path = tmp_path / 'mine.yaml'
    path.write_text(text)
    for command in re.findall(r'^ragdoll_fit (\w+\.urdf) -o (\w+\.yaml)$',
                              '\n'.join(PAGES.values()), re.M):
        if command[1] in text:
            assert fit_main([str(ROOT / 'config' / command[0]), '-o',
                             str(tmp_path / command[1])]) == 0
    if re.search('^who:', text, re.M):
        assert next(generate(load_recipe(path), [0])).failure == ''
        return
    if re.search('^regions:', text, re.M):
        assert ragdoll_ros.load_limits(path).regions
        return
    with ragdoll_ros.Simulation(ragdoll_ros.load_scene(str(path))) as simulation:
        assert np.isfinite(simulation.advance().positions).all()


def test_scenes_page_names_every_key_and_every_shipped_file():
    named = set(re.findall(r'`(\w+)`', PAGES['docs/scenes.md']))
    shipped = {path.stem for path in (ROOT / 'config').glob('*.yaml')
               if re.search('^(dolls|bones):', path.read_text(), re.M)}
    assert shipped <= named
    for schema in ('scene', 'doll'):
        data = json.loads((ROOT / 'config' / f'{schema}.schema.json').read_text())
        assert keys(data) <= named, keys(data) - named


def keys(schema):
    """All keys that a file of a schema may have."""
    if isinstance(schema, list):
        return set().union(*map(keys, schema))
    if not isinstance(schema, dict):
        return set()
    own = schema.get('properties', {})
    return set(own) | keys(list(own.values())) | keys(
        [value for key, value in schema.items() if key != 'properties'])


def test_falls_page_names_every_key_and_every_format():
    named = set(re.findall(r'`(\w+)[`:]', PAGES['docs/falls.md']))
    data = json.loads((ROOT / 'config/recipe.schema.json').read_text())
    assert keys(data) <= named, keys(data) - named
    assert coded(table('docs/falls.md', 'Formats')) >= set(FORMATS)


def test_the_table_of_packages_is_the_summary_of_their_robots():
    summary = runpy.run_path(str(ROOT / 'docs/robots.py'))['summary']
    assert summary(PAGES['docs/robots.md']) in PAGES['docs/fit.md']


def test_measures_are_told_one_by_one():
    told = coded(table('docs/accuracy_explained.md', 'What the simulation reports about itself'))
    found = set()
    drop = ragdoll_ros.load_scene('drop')
    bone = ragdoll_ros.Bone('robot', ragdoll_ros.Sphere(0.1), 1.0, (0, 0, 0))
    robot = ragdoll_ros.Placement(ragdoll_ros.Ragdoll('robot', (bone,)), position=(9, 0, 1),
                                  follow=ragdoll_ros.Follow())
    driven = dataclasses.replace(drop, dolls=(*drop.dolls, robot))
    for scene, engine in ((driven, 'auto'), (drop, 'bullet')):
        with ragdoll_ros.Simulation(scene, engine=engine) as simulation:
            found |= set(simulation.measures())
    assert told == found


def test_every_target_and_every_command_has_its_line():
    told = coded(table('CONTRIBUTING.md', 'Test'))
    assert {name.removeprefix('make ') for name in told} == TARGETS
    told = coded(table('docs/reference.md', 'Commands'))
    assert {name for name in told if name.startswith('ragdoll_')} == set(EXECUTABLES)


@pytest.mark.parametrize('line', list(commands()))
def test_command_exists(line):
    program, *rest = words_of(line)
    if program in FOREIGN:
        return
    if program == 'ros2':
        if rest[:2] == ['run', 'ragdoll_ros']:
            check_executable(*rest[2:])
    elif program in EXECUTABLES:
        check_executable(program, *rest)
    elif program == 'make':
        for word in rest:
            name, _, value = word.partition('=')
            assert f'$({name})' in MAKEFILE if value else name in TARGETS, word
    elif program == 'pip':
        check_installed(rest[1:])
    else:
        assert program in ('python', 'python3'), f'{program}: neither ours nor known'
        check_python(*rest)


def check_executable(name, *words):
    options = [word.split('=')[0] for word in words[:words.index('--ros-args')]
               ] if '--ros-args' in words else [word for word in words if word.startswith('--')]
    assert name in EXECUTABLES
    options = [option for option in options if option.startswith('--')]
    if options:
        assert set(options) <= set(re.findall(r'--[a-z-]+', help_of(name)))


def help_of(name):
    said = []
    with pytest.MonkeyPatch.context() as patch, contextlib.suppress(SystemExit):
        patch.setattr('argparse.ArgumentParser._print_message',
                      lambda self, message, file=None: said.append(message))
        importlib.import_module(EXECUTABLES[name]).main(['--help'])
    return ''.join(said)


def check_installed(words):
    for word in words:
        extras = re.fullmatch(r'\.\[(.*)\]', word)
        if extras:
            assert set(extras[1].split(',')) <= set(EXTRAS), word
        elif not word.startswith('-'):
            assert word == '.' or re.search(rf"'{word}\b", SETUP), word


def check_python(first, *rest):
    if first == '-m':
        assert importlib.util.find_spec(rest[0]) is not None, rest[0]
        return
    text = (ROOT / first).read_text()
    for word in rest:
        assert not word.startswith('--') or f"'{word}'" in text, word


@pytest.mark.parametrize('name', PAGES)
def test_links_lead_somewhere(name):
    prose = re.sub(r'^```.*?^```', '', PAGES[name], flags=re.M | re.S)
    for target in re.findall(r'\]\(([^)\s]+)\)', prose):
        if target.startswith(('http:', 'https:')):
            continue
        file, _, anchor = target.partition('#')
        path = (ROOT / name).parent / file if file else ROOT / name
        assert path.is_file(), target
        assert not anchor or anchor in anchors(path.read_text()), target


def anchors(page):
    """What links to the titles of a page end in, as GitHub and GitLab make them."""
    titles = re.findall(r'^#+ (.*)$', re.sub(r'^```.*?^```', '', page, flags=re.M | re.S), re.M)
    return {re.sub(r'[^\w\- ]', '', title.lower()).replace(' ', '-') for title in titles}


def test_every_page_is_reached_from_the_readme():
    reached, waiting = set(), ['README.md']
    while waiting:
        name = waiting.pop()
        if name in PAGES and name not in reached:
            reached.add(name)
            for file in re.findall(r'\]\(([^)\s#]+\.md)', PAGES[name]):
                path = ((ROOT / name).parent / file).resolve()
                waiting.append(path.relative_to(ROOT).as_posix())
    assert reached == set(PAGES)
