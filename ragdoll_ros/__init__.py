"""A passive doll for ROS 2: a scene is data, a simulation turns a scene and pushes into states."""
