"""Message packages that PyPI does not have, built by the generators of ROS's wheels.

python test/message_packages.py FOLDER tf2_msgs hri_msgs
"""
from __future__ import annotations

import os
import re
import subprocess
import sys
import sysconfig
from pathlib import Path

import simulation_interfaces_types

GENERATORS = [f'ros-jazzy-{name}' for name in (
    'ament-cmake', 'ament-cmake-gmock', 'ament-cmake-gtest', 'ament-cmake-include-directories',
    'ament-cmake-pytest', 'ament-cmake-ros', 'ament-package', 'common-interfaces',
    'fastrtps-cmake-module', 'python-cmake-module', 'rmw-fastrtps-cpp',
    'rosidl-core-generators', 'rosidl-default-generators', 'rosidl-generator-py')]
TOOLS = ['catkin_pkg', 'cmake', 'empy<4', 'lark', 'ninja', 'numpy', 'setuptools<80']

PACKAGES = {
    'tf2_msgs': (['geometry_msgs'], {
        'msg/TFMessage.msg': 'geometry_msgs/TransformStamped[] transforms\n'}),
    'hri_msgs': (['std_msgs'], {'msg/IdsList.msg': 'std_msgs/Header header\nstring[] ids\n'}),
    'simulation_interfaces': (['action_msgs', 'geometry_msgs', 'std_msgs'],
                              simulation_interfaces_types.VERSION_2),
    'simulation_interfaces 1': (['action_msgs', 'geometry_msgs', 'std_msgs'],
                                simulation_interfaces_types.VERSION_1)}
"""Of each package what it depends on, and its types that are used here; a version may follow."""

PACKAGE = """<package format="3">
  <name>{name}</name> <version>0.36.0</version> <description>types</description>
  <maintainer email="tf2@example.org">nobody</maintainer> <license>BSD</license>
  <buildtool_depend>ament_cmake</buildtool_depend>
  <buildtool_depend>rosidl_default_generators</buildtool_depend>
  {depends}
  <member_of_group>rosidl_interface_packages</member_of_group>
  <export><build_type>ament_cmake</build_type></export>
</package>
"""

CMAKE = """cmake_minimum_required(VERSION 3.20)
project({name})
find_package(ament_cmake REQUIRED)
{finds}
find_package(rosidl_default_generators REQUIRED)
rosidl_generate_interfaces({name} {files} DEPENDENCIES {needed})
ament_package()
"""


def build(folder: Path, *names: str) -> dict[str, str]:
    """Build packages in a folder, with an environment of its own; what a process needs of them."""
    tools, prefix = folder / 'environment', folder / 'prefix'
    _run(sys.executable, '-m', 'venv', tools)
    _run(tools / 'bin/pip', 'install', '--quiet', *TOOLS, *GENERATORS)
    site = next(tools.glob('lib/python3*/site-packages'))
    _mend(tools / 'share', site)
    places = {'PATH': f'{tools}/bin:{os.environ["PATH"]}', 'LD_LIBRARY_PATH': f'{tools}/lib',
              'AMENT_PREFIX_PATH': str(tools), 'CMAKE_PREFIX_PATH': f'{tools}:{site}',
              'PYTHONPATH': ''}
    python = tools / 'bin/python'
    for name in names:
        source, made = folder / name, folder / f'build_{name}'
        needed, types = PACKAGES[name]
        fields = {'name': name.split()[0], 'needed': ' '.join(needed), 'files': ' '.join(types),
                  'depends': ' '.join(f'<depend>{each}</depend>' for each in needed),
                  'finds': '\n'.join(f'find_package({each} REQUIRED)' for each in needed)}
        for path, content in (*types.items(), ('package.xml', PACKAGE.format(**fields)),
                              ('CMakeLists.txt', CMAKE.format(**fields))):
            (source / path).parent.mkdir(parents=True, exist_ok=True)
            (source / path).write_text(content)
        _run(tools / 'bin/cmake', '-S', source, '-B', made, '-G', 'Ninja',
             f'-DCMAKE_INSTALL_PREFIX={prefix}', '-DBUILD_TESTING=OFF',
             f'-DPython3_EXECUTABLE={python}', f'-DPYTHON_EXECUTABLE={python}', **places)
        _run(tools / 'bin/cmake', '--build', made, '--target', 'install', **places)
    return {'LD_LIBRARY_PATH': str(prefix / 'lib'),
            'PYTHONPATH': str(next(prefix.glob('lib/python3*/site-packages')))}


def _mend(share: Path, site: Path) -> None:
    """Point the wheels' CMake files to this Python, not to that of who has built them."""
    for path in share.rglob('*.cmake'):
        text = path.read_text()
        here = re.sub(r'/opt/python/[^/;"]*/include/python3[^/;"]*',
                      sysconfig.get_path('include'), text)
        here = re.sub(r'/opt/python/[^/;"]*/lib/python3[^/;"]*/site-packages', str(site), here)
        if here != text:
            path.write_text(here)


def _run(*command: object, **variables: str) -> None:
    done = subprocess.run([str(part) for part in command], env={**os.environ, **variables},
                          capture_output=True, text=True, timeout=900)
    assert done.returncode == 0, f'{command}\n{done.stdout}\n{done.stderr}'


if __name__ == '__main__':
    print(build(Path(sys.argv[1]), *sys.argv[2:]))
