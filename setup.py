"""Packaging for colcon (apt's Jazzy) and for pip (Jazzy's wheels, or no ROS at all)."""
from __future__ import annotations

import shutil
from pathlib import Path

from setuptools import Distribution, find_packages, setup
from setuptools.command.build_py import build_py

NAME = 'ragdoll_ros'
EXECUTABLES = {
    'ragdoll_node': 'ragdoll_ros.ros.node:main',
    'ragdoll_teleop': 'ragdoll_ros.ros.teleop.teleop:main',
    'ragdoll_viewer': 'ragdoll_ros.viewer.command:main',
    'ragdoll_fit': 'ragdoll_ros.fit.command:main',
    'ragdoll_report': 'ragdoll_ros.accuracy.report.command:main',
    'ragdoll_replay': 'ragdoll_ros.replay.command:main',
    'ragdoll_falls': 'ragdoll_ros.falls.command:main',
    'ragdoll_person': 'ragdoll_ros.people.command:main',
}
CONFIG, RECIPES, LIMITS, LAUNCH = (
    sorted(str(path) for path in Path(folder).iterdir() if path.is_file())
    for folder in ('config', 'config/recipes', 'config/limits', 'launch'))
LAUNCHER = '#!/bin/sh\nexec "$(dirname "$0")/../../bin/$(basename "$0")" "$@"\n'
"""What `ros2 run` finds in a wheel's lib/ragdoll_ros: the way to the script that pip put in bin."""


class BuildWithConfig(build_py):
    """Ships config/ inside the package too, for where no ROS prefix points to share/."""

    def run(self) -> None:
        """Build, then copy config/; an editable install reads the checkout's."""
        super().run()
        if not getattr(self, 'editable_mode', False):
            for source, target in self._config():
                self.mkpath(str(target.parent))
                shutil.copyfile(source, target)

    def get_outputs(self, include_bytecode: bool = True) -> list[str]:
        """Name the copies as well, so that they can be uninstalled."""
        outputs = super().get_outputs(include_bytecode)
        return outputs + [str(target) for _, target in self._config()]

    def _config(self) -> list[tuple[str, Path]]:
        return [(source, Path(self.build_lib, NAME, source))
                for source in CONFIG + RECIPES + LIMITS]


class InstallDataWithLaunchers(Distribution().get_command_class('install_data')):
    """Puts the executables into lib/ragdoll_ros of a wheel; colcon does so by itself."""

    def run(self) -> None:
        """Install the data files and, into a wheel, the launchers."""
        super().run()
        if 'bdist_wheel' not in self.distribution.command_obj:
            return
        for name in EXECUTABLES:
            path = Path(self.install_dir, 'lib', NAME, name)
            self.mkpath(str(path.parent))
            path.write_text(LAUNCHER)
            path.chmod(0o755)
            self.outfiles.append(str(path))


setup(
    name=NAME,
    version='0.1.0',
    description='A passive doll of rigid bodies: takes pushes, publishes the pose of every bone.',
    license='Apache-2.0',
    maintainer='ragdoll_ros maintainers',
    maintainer_email='maintainers@users.noreply.github.com',
    python_requires='>=3.10',
    packages=find_packages(include=[NAME, f'{NAME}.*']),
    package_data={NAME: ['py.typed'], f'{NAME}.viewer.browser': ['*.js', '*.css'],
                  f'{NAME}.viewer.gallery': ['*.json', '*.webp']},
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{NAME}']),
        (f'share/{NAME}', ['package.xml']),
        (f'share/{NAME}/config', CONFIG),
        (f'share/{NAME}/config/recipes', RECIPES),
        (f'share/{NAME}/config/limits', LIMITS),
        (f'share/{NAME}/launch', LAUNCH),
    ],
    cmdclass={'build_py': BuildWithConfig, 'install_data': InstallDataWithLaunchers},
    entry_points={'console_scripts': [f'{name} = {place}' for name, place in EXECUTABLES.items()]},
    # numba 0.59 is the first for Ubuntu 24.04's Python.
    install_requires=['numpy', 'pyyaml', 'jsonschema', 'pybullet', 'numba>=0.59'],
    extras_require={
        'ros': ['ros-jazzy-rclpy', 'ros-jazzy-rmw-fastrtps-cpp', 'ros-jazzy-common-interfaces'],
        'report': ['scipy', 'matplotlib', 'mujoco'],
        # Compared in the report where they are installed.
        'peers': ['dartpy', 'drake'],
        'fit': ['matplotlib', 'trimesh', 'pycollada', 'scipy', 'DracoPy', 'vhacdx', 'xacro'],
        # The page: 3D, panels and plots in a browser, served from Python, with no build of its own.
        # Its range is that of viewer/viser_internals.py, which uses private names of viser.
        'viewer': ['viser>=1.1.1,<1.2', 'imageio', 'mcap'],
        'replay': ['mcap'],
        'falls': ['pyarrow', 'mcap-ros2-support', 'matplotlib'],
        'ray': ['ray'],
        # axe-playwright-python ships axe-core, the usual audit of a page for all users.
        'test': ['pytest', 'pytest-xdist', 'ruff', 'setuptools', 'wheel', 'yourdfpy', 'rosbags',
                 'pandas', 'playwright', 'axe-playwright-python', 'pygltflib', 'bvhio',
                 'nbclient', 'nbformat', 'ipykernel', 'mypy', 'rtree',
                 'mannequin-x; python_version >= "3.11"'],
        'colcon': ['colcon-core', 'colcon-ros', 'colcon-python-setup-py',
                   'colcon-common-extensions', 'setuptools<80'],
    },
    zip_safe=False,  # numba keeps what it compiles beside the source, and wants it as a file
)
