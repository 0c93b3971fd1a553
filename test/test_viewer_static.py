"""The page without a server: `ragdoll_viewer --static`, in headless Chromium."""
from __future__ import annotations

import functools
import http.server
import threading

import numpy as np
import pytest

pytest.importorskip('viser')
from browser import View, chromium

from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.physics.simulation import Simulation
from ragdoll_ros.recordings.mcap_file import recording_bytes
from ragdoll_ros.recordings.recording import Recorder
from ragdoll_ros.viewer.command import main

SCENE = load_scene('drop')


@pytest.fixture(scope='module')
def states():
    with Simulation(SCENE) as simulation:
        return [simulation.state, *(simulation.advance() for _ in range(400))]


@pytest.fixture
def served(tmp_path):
    """A folder that a plain web server shows, and its address."""
    class Quiet(http.server.SimpleHTTPRequestHandler):
        def log_message(self, *_):
            pass

    handler = functools.partial(Quiet, directory=str(tmp_path))
    with http.server.ThreadingHTTPServer(('127.0.0.1', 0), handler) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        yield tmp_path, f'http://127.0.0.1:{server.server_address[1]}/'
        server.shutdown()
        thread.join()


def stands(view):
    """Whether the bodies are drawn at the same places for a while."""
    before = view.bodies(SCENE)
    view.page.wait_for_timeout(300)
    return (view.bodies(SCENE) == before).all()


def test_a_fall_can_be_stopped_and_scrubbed(served, states, capsys):
    """Where the slider says 0.5 s the doll is drawn as a simulation here has it then.

    Pictures are at sixtieths of a second; 0.5 s is one, and a tick. Numbers have 32 bits.
    """
    folder, url = served
    assert main(['--static', str(folder / 'out'), '--scene', 'drop']) == 0
    assert f'{folder}/out/index.html: ' in capsys.readouterr().out
    with chromium() as browser:
        view = View(browser, url + 'out/')
        view.wait(lambda: np.isfinite(view.bodies(SCENE)).all())
        view.wait(lambda: abs(view.bodies(SCENE) - states[0].positions).max() > 0.05)
        view.key(' ')
        # A picture that is due when Space is pressed sets the time once more.
        view.wait(lambda: stands(view))
        field = view.page.locator('input').first
        # It shows tenths: what stands at 0.54 s is 0.5 already, and the same again is no change.
        for time in ('0.2', '0.5'):
            field.fill(time)
            field.press('Enter')
        view.wait(lambda: abs(view.bodies(SCENE) - states[50].positions).max() < 1e-6)
        assert stands(view)
        assert not view.errors
        view.close()


def test_a_recorded_run_is_written_too(tmp_path, capsys):
    recorder = Recorder(SCENE)
    with Simulation(SCENE) as simulation:
        recorder.take(simulation)
    (tmp_path / 'run.mcap').write_bytes(recording_bytes(recorder.recording()))
    assert main(['--static', str(tmp_path / 'out'), '--play', str(tmp_path / 'run.mcap')]) == 0
    assert '0.0 s' in capsys.readouterr().out and (tmp_path / 'out/index.html').is_file()


def test_what_cannot_be_written_is_refused(tmp_path, capsys):
    (tmp_path / 'file').touch()
    for arguments in ([], ['--scene', 'drop', '--ros-args', '-r', '__ns:=/stage']):
        assert main(['--static', str(tmp_path / 'out'), *arguments]) == 2
        assert 'expected --scene or --play' in capsys.readouterr().err
        assert not (tmp_path / 'out').exists()
    assert main(['--static', str(tmp_path / 'file' / 'x'), '--scene', 'drop']) == 2
    assert 'can be written to' in capsys.readouterr().err
