"""Robots in xacro: expanded by the package xacro, against the same robot written by hand."""
import sys

import pytest

from ragdoll_ros.fit.command import main
from ragdoll_ros.fit.robots.robot import doll_from_urdf, read_urdf
from ragdoll_ros.model import errors

XACRO = """<?xml version="1.0"?>
<robot name="arm" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:arg name="length" default="0.5"/>
  <xacro:property name="l" value="$(arg length)"/>
  <xacro:macro name="bar" params="name">
    <link name="${name}"><inertial><mass value="${2 * l}"/><origin xyz="0 0 ${l / 2}"/>
      <inertia ixx="0.1" iyy="0.1" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>
      <collision><origin xyz="0 0 ${l / 2}"/><geometry><cylinder radius="0.05" length="${l}"/>
      </geometry></collision></link>
  </xacro:macro>
  <xacro:bar name="upper"/><xacro:bar name="lower"/>
  <joint name="elbow" type="revolute"><parent link="upper"/><child link="lower"/>
    <origin xyz="0 0 ${l}"/><axis xyz="0 1 0"/><limit lower="${-pi / 2}" upper="${pi / 2}"/></joint>
</robot>"""


def written(length, half_turn):
    bars = ''.join(f"""<link name="{name}"><inertial><mass value="{2 * length}"/>
      <origin xyz="0 0 {length / 2}"/>
      <inertia ixx="0.1" iyy="0.1" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>
      <collision><origin xyz="0 0 {length / 2}"/><geometry>
      <cylinder radius="0.05" length="{length}"/></geometry></collision></link>"""
                   for name in ('upper', 'lower'))
    return f"""<robot name="arm">{bars}<joint name="elbow" type="revolute">
      <parent link="upper"/><child link="lower"/><origin xyz="0 0 {length}"/><axis xyz="0 1 0"/>
      <limit lower="{-half_turn}" upper="{half_turn}"/></joint></robot>"""


def test_a_xacro_is_the_urdf_that_it_expands_to(tmp_path):
    pytest.importorskip('xacro')
    path = tmp_path / 'arm.urdf.xacro'
    path.write_text(XACRO)
    doll, _ = read_urdf(path)
    assert doll == doll_from_urdf(written(0.5, 1.5707963267948966))
    assert doll.joints[0].angle_names == ('elbow',)
    assert main([str(path), '-o', str(tmp_path / 'arm.yaml')]) == 0


@pytest.mark.parametrize('change, text', [
    (('${l / 2}', '${nobody / 2}'), 'nobody'), (('</robot>', ''), 'a xacro that expands'),
    (('<xacro:bar name="upper"/>', '<xacro:include filename="$(find no_such_package)/a.xacro"/>'),
     'a xacro that expands')])
def test_a_xacro_that_does_not_expand_is_refused_in_one_sentence(tmp_path, capsys, change, text):
    pytest.importorskip('xacro')
    (tmp_path / 'arm.xacro').write_text(XACRO.replace(*change))
    assert main([str(tmp_path / 'arm.xacro')]) == 2
    told = capsys.readouterr().err
    assert text in told and len(told.splitlines()) == 1


def test_without_xacro_it_says_what_to_install(tmp_path, monkeypatch):
    (tmp_path / 'arm.xacro').write_text(XACRO)
    monkeypatch.setitem(sys.modules, 'xacro', None)
    with pytest.raises(errors.ModelErrors, match='pip install xacro'):
        read_urdf(tmp_path / 'arm.xacro')
