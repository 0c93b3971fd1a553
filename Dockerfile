# ragdoll_ros on the official image of ROS 2 Jazzy:
#   docker build --tag ragdoll_ros .
#   docker run --rm --network host ragdoll_ros
FROM ros:jazzy
# pip has to compile PyBullet: PyPI has no binary of it for Python 3.12. See docs/ros.md.
ENV PIP_BREAK_SYSTEM_PACKAGES=1
RUN apt-get update \
    && apt-get install --yes --no-install-recommends g++ python3-dev python3-pip \
    && rm -rf /var/lib/apt/lists/*
WORKDIR /workspace
COPY . src/ragdoll_ros
RUN apt-get update && rosdep update --rosdistro jazzy \
    && rosdep install --yes --from-paths src --ignore-src --rosdistro jazzy \
    && rm -rf /var/lib/apt/lists/*
# apt's numba is too old for its Python; the page has no key of rosdep.
RUN pip install 'numba>=0.59' 'viser>=1.1.1,<1.2' imageio mcap
RUN . /opt/ros/jazzy/setup.sh && colcon build --packages-select ragdoll_ros
RUN . install/setup.sh && python3 -m ragdoll_ros.physics.kernels
ENTRYPOINT ["/bin/sh", "-c", ". /workspace/install/setup.sh && exec \"$@\"", "--"]
CMD ["ros2", "run", "ragdoll_ros", "ragdoll_node"]
