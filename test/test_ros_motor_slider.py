"""The page's slider for the strength of motors, on a node in a process of its own."""
from __future__ import annotations

import json

import pytest

pytest.importorskip('viser')
from browser import chromium, opened
from page_client import served
from peer import kill, listening, start
from std_msgs.msg import String
from test_viewer_motors import fells_the_doll, slider, standing

from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.viewer.sources.node.source import NodeSource


def test_over_its_topic_the_slider_fells_the_doll_of_a_node(ros, tmp_path):
    path = standing(tmp_path)
    scene = load_scene(path)
    with listening() as peer:
        events = peer.collect(String, 'ragdoll/events')
        node = start('node', '--ros-args', '-p', f'scene:={path}', compiled=True)
        try:
            with (served(NodeSource([])) as page, chromium() as browser, opened(
                    browser, f'http://127.0.0.1:{page.server.get_port()}', scene) as view):
                view.wait(lambda: slider(view).count())
                # An event that is published before its topic is matched is never heard.
                view.wait(lambda: events or view.press('Reset'))
                fells_the_doll(page, view, scene, lambda: any(
                    event['kind'] == 'set_strength' and event['strength'] == 0
                    for event in (json.loads(message.data) for _, message in list(events))))
        finally:
            kill(node)
