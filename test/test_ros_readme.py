"""README.md says what is: its messages can be sent, its tables are complete, its scene loads."""
import importlib
import re
from pathlib import Path

import pytest
import yaml

from ragdoll_ros.files.config import find
from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.ros.parameters import BONE_NAMES, SPECS

ROOT = Path(__file__).resolve().parent.parent
README = (ROOT / 'README.md').read_text()
SENT = re.findall(r"ros2 (?:topic pub --once|service call) (\S+) (\w+)/(msg|srv)/(\w+)"
                  r"(?: *\\?\n? *'(.*)')?", README)


def topics_and_services(node):
    """Give the names and types of all that a node offers, by what it is: out, in or service."""
    name, namespace = node.get_name(), node.get_namespace()
    return [*node.get_publisher_names_and_types_by_node(name, namespace),
            *node.get_subscriber_names_and_types_by_node(name, namespace),
            *node.get_service_names_and_types_by_node(name, namespace)]


def fill(message, values):
    for key, value in values.items():
        if isinstance(value, dict):
            fill(getattr(message, key), value)
        else:
            setattr(message, key, value)  # rclpy asserts name, type and range


def table(title):
    """First two cells of each row of the table below a title."""
    section = README.split(f'## {title}\n')[1].split('\n## ')[0]
    return re.findall(r'^\| (`.*?) \| (.*?) \|', section, re.M)


def test_readme_has_seven_lines_to_copy():
    """Else the next test may have nothing to look at."""
    assert len(SENT) == README.count('ros2 topic pub') + README.count('ros2 service call') == 7


@pytest.mark.parametrize(('target', 'package', 'kind', 'name', 'text'), SENT)
def test_line_to_copy_is_a_message_the_node_takes(make_node, target, package, kind, name, text):
    made = getattr(importlib.import_module(f'{package}.{kind}'), name)
    fill(made() if kind == 'msg' else made.Request(), yaml.safe_load(text or '{}'))
    assert (target, [f'{package}/{kind}/{name}']) in topics_and_services(make_node())


def test_tables_name_all_that_the_node_has(make_node):
    told = {'/' + name.replace('~', 'ragdoll').lstrip('/')
            for cell, _ in table('Topics and services') for name in re.findall('`(.*?)`', cell)}
    own = re.compile('/ragdoll/(describe|get|list|set)_|/(rosout|parameter_events)$')
    offered = {name for name, _ in topics_and_services(make_node(publish_clock=True,
                                                                     scene='ponytail'))}
    assert told == {name for name in offered if not own.search(name)}


def test_table_of_parameters_is_complete_with_defaults(make_node):
    told = {name: default for cell, default in table('Parameters')
            for name, default in zip(re.findall('`(.*?)`', cell), default.split(', '),
                                     strict=False)}
    assert set(told) == {*SPECS, BONE_NAMES}
    settings = make_node().settings
    for name, default in told.items():
        if not default.startswith('the '):
            assert yaml.safe_load(default.strip('`')) == getattr(settings, name), name


def test_scene_of_the_readme_loads(tmp_path):
    text = re.search(r'(?:^    .*\n)+', README.split('no\nmore than\n')[1], re.M)[0]
    (tmp_path / 'mine.yaml').write_text(re.sub('^    ', '', text, flags=re.M))
    scene = load_scene(str(tmp_path / 'mine.yaml'))
    assert scene.ground is not None and scene.dolls[0].spin == (0, 2, 0)


def test_scenes_and_files_that_are_named_exist():
    section = README.split('## Scenes\n')[1]
    for name in re.findall(r'`(\w+)` \(', section):
        assert find(name).is_file()
    for path in re.findall(r'share ragdoll_ros\)/(\S+)', README):
        assert (ROOT / path).is_file()
