"""A file that is no scene: what is told of it has nothing of its content."""
from __future__ import annotations

import pytest

from ragdoll_ros.falls.recipe import load_recipe
from ragdoll_ros.files.config import RECIPES, config_folder
from ragdoll_ros.files.doll import load_doll
from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.model.errors import ModelErrors

SECRET = 'hunter2'

FILES = {
    'shadow': f'root:${SECRET}:19000:0:99999:7:::\nuser:${SECRET}:19000::\n',
    'passwd': f'root:x:0:0:{SECRET}:/root:/bin/sh\n',
    'token': SECRET, 'token_line': f'{SECRET}\n', 'empty_then': f'\n\n{SECRET}',
    'env': f'PASSWORD={SECRET}\nUSER=alice\n',
    'ini': f'[db]\npassword = {SECRET}\n', 'json': f'{{"password": "{SECRET}"}}',
    'json_list': f'["{SECRET}", 1]', 'yaml': f'password: {SECRET}\n',
    'yaml_key': f'{SECRET}: password\n', 'yaml_deep': f'a: {{b: [{{c: {SECRET}}}]}}\n',
    'yaml_list': f'- {SECRET}\n- x\n', 'yaml_tag': f'!{SECRET} x\n',
    'yaml_anchor': f'&{SECRET} x: *{SECRET}\n', 'yaml_alias': f'x: *{SECRET}\n',
    'yaml_broken': f'password: {SECRET}\n  x: [\n', 'yaml_quote': f'password: "{SECRET}\n',
    'yaml_tab': f'password:\n\t{SECRET}: x\n', 'yaml_escape': f'"\\{SECRET}"\n',
    'yaml_int': f'x: !!int {SECRET}\n', 'yaml_float': f'x: !!float {SECRET}\n',
    'yaml_date': f'x: !!timestamp {SECRET}\n', 'yaml_binary': f'x: !!binary {SECRET}=\n',
    'two_documents': f'a: 1\n---\n{SECRET}: 2\n', 'directive': f'%{SECRET} 1\n---\nx\n',
    'key': f'-----BEGIN PRIVATE KEY-----\n{SECRET}\n-----END PRIVATE KEY-----\n',
    'xml': f'<password>{SECRET}</password>\n', 'csv': f'user,password\nalice,{SECRET}\n',
    'binary': b'\x89PNG\r\n' + SECRET.encode() + b'\xff\xfe', 'nul': SECRET.encode() + b'\0',
    'code': f'password = "{SECRET}"\nprint(password)\n'}


def test_there_are_thirty():
    assert len(FILES) >= 30


@pytest.mark.parametrize('name', FILES)
def test_nothing_of_it_is_told(tmp_path, name):
    path, content = tmp_path / 'file.yaml', FILES[name]
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    for load in (load_scene, load_doll, load_recipe):
        with pytest.raises(ModelErrors) as caught:
            load(str(path))
        assert str(path) in str(caught.value)
        for word in (SECRET, 'alice', 'BEGIN'):
            assert word not in str(caught.value)


@pytest.mark.parametrize('name', FILES)
def test_nor_where_a_scene_names_it_as_its_doll(tmp_path, name):
    content = FILES[name]
    (tmp_path / 'file').write_bytes(
        content if isinstance(content, bytes) else content.encode())
    (tmp_path / 'scene.yaml').write_text('dolls: [{doll: file}]\n')
    with pytest.raises(ModelErrors) as caught:
        load_scene(str(tmp_path / 'scene.yaml'))
    assert SECRET not in str(caught.value) and 'dolls[0].doll' in str(caught.value)


@pytest.mark.parametrize('name', ['shadow', 'yaml', 'yaml_broken', 'binary', 'token'])
def test_nor_by_a_node(make_node, peer, tmp_path, capfd, name):
    """In the refusal of the parameter, in its log, in /diagnostics."""
    from diagnostic_msgs.msg import DiagnosticArray
    from rclpy.parameter import Parameter
    node = make_node(scene='drop')
    heard = peer.collect(DiagnosticArray, '/diagnostics')
    peer.executor_.add_node(node)
    content = FILES[name]
    (tmp_path / 'file').write_bytes(
        content if isinstance(content, bytes) else content.encode())
    result = node.set_parameters_atomically(
        [Parameter('scene', value=str(tmp_path / 'file'))])
    assert not result.successful and SECRET not in result.reason

    def told():
        return [text for _, message in heard for status in message.status
                for text in (status.message, *(pair.value for pair in status.values))]

    peer.wait(lambda: any('Unreadable' in text or 'WrongForm' in text for text in told()))
    out, err = capfd.readouterr()
    assert not any(SECRET in text for text in (*told(), out, err))


def test_a_scene_with_a_fault_is_still_told_with_its_value(tmp_path):
    """Its line too, where it is no YAML; and a recipe of falls is named as such."""
    path = tmp_path / 'scene.yaml'
    path.write_text('dolls: [{doll: doll}]\nstep: fast\n')
    with pytest.raises(ModelErrors, match="step: WrongForm: 'fast'"):
        load_scene(str(path))
    path.write_text('dolls: [{doll: doll}]\nstep: "0.01\n')
    with pytest.raises(ModelErrors, match='line'):
        load_scene(str(path))
    with pytest.raises(ModelErrors, match='a mapping without dolls, but a recipe'):
        load_scene(str(config_folder() / RECIPES / 'tumble.yaml'))
    with pytest.raises(ModelErrors, match='a mapping without who, but a scene'):
        load_recipe(config_folder() / 'drop.yaml')
