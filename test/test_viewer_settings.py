"""Settings and health on the page: what is chosen is what is simulated, what is wrong is said."""
from __future__ import annotations

import dataclasses
import json
import math
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip('viser')
from page_client import served, wait

from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.model.scene import Ground
from ragdoll_ros.physics.accuracy import ACCURACIES
from ragdoll_ros.viewer.health import GRACE, figures, health
from ragdoll_ros.viewer.settings_panel import ERRORS_MM, slope_of, sloping
from ragdoll_ros.viewer.sources.simulation import SimulationSource, TickStatistics
from ragdoll_ros.viewer.sources.source import RequestedData, SourceStatus
from ragdoll_ros.viewer.widgets.form import AMBER, GREEN, GREY, RED

DROP = load_scene('drop')
WEIGHT = 9.8 * sum(bone.mass for bone in DROP.bones)


@pytest.fixture
def page():
    with served(SimulationSource(DROP)) as page:
        page.client = page.open()
        wait(lambda: page.stage and page.frame and page.frame.time > 0.1)
        yield page


def test_the_tempo_of_ticks():
    """Ticks of 10 ms every 20 ms that take 5 ms each: half the pace; what is older is forgotten."""
    statistics = TickStatistics()
    assert math.isnan(statistics.real_time_factor) and math.isnan(statistics.mean_cost)
    for k in range(200):
        statistics.add(0.02 * k, 0.02 * k + (0.5 if k < 100 else 0.005), 0.01)
    assert statistics.real_time_factor == pytest.approx(0.5)
    assert statistics.mean_cost == pytest.approx(0.005)


WELL = SourceStatus(measured_real_time_factor=0.99, tick_cost=2e-4)


@pytest.mark.parametrize(('changes', 'color', 'reason'), [
    ({}, GREEN, 'Running'),
    ({'paused': True, 'measured_real_time_factor': 0.1}, GREEN, 'Paused'),
    ({'measured_real_time_factor': 0.6, 'tick_cost': 0.016}, AMBER, 'Choose accuracy draft'),
    ({'measured_real_time_factor': 0.6}, AMBER, 'the machine is busy'),
    ({'measures': {'energy_excess_J': 0.0011 * WEIGHT}}, RED, 'Use accuracy exact'),
    ({'measures': {'energy_excess_J': 0.0011 * WEIGHT, 'work_of_pushes_J': WEIGHT}}, GREEN, ''),
    ({'measures': {'energy_excess_J': -300.0}}, GREEN, ''),
    ({'problem': 'the state was not finite'}, RED, 'not finite'),
    ({'problem': 'the node has ended', 'silent': True}, GREY, 'No messages')])
def test_health_has_a_colour_and_a_reason(changes, color, reason):
    status = dataclasses.replace(WELL, **changes)
    found = health(status, DROP)
    assert found.color == color and reason in found.text
    assert ('real-time factor' in figures(status, DROP)) != status.paused


def test_nothing_is_said_of_a_source_that_does_not_compute():
    assert health(SourceStatus(), DROP) is None and figures(SourceStatus(), DROP) == ''


def test_nothing_alarms_at_once_and_silence_is_grey(page):
    """After a resume, another pace and another scene, a while; what lasts is said then."""
    slow = dataclasses.replace(WELL, measured_real_time_factor=0.1)
    panel, now = page.settings.health.__class__(page.server.gui), 100.0
    for changes, scene in (({}, DROP), ({'paused': True}, DROP), ({}, DROP),
                           ({'real_time_factor': 0.5}, DROP), ({}, load_scene('flight'))):
        status = dataclasses.replace(slow, **changes)
        panel.show(status, scene, now)
        assert GREEN in panel.dot.content
        panel.show(status, scene, now + 0.9 * GRACE)
        assert GREEN in panel.dot.content
        panel.show(status, scene, now + 1.1 * GRACE)
        assert (AMBER in panel.dot.content) != status.paused
        now += 100
    panel.show(dataclasses.replace(slow, silent=True), DROP, now)
    assert GREY in panel.dot.content and 'No messages' in panel.dot.content


def test_errors_are_those_of_the_report():
    """Rounded as they are shown: to 0.01 mm, and those of other engines to mm."""
    rows = json.loads((Path(__file__).parents[1] / 'docs/accuracy.json').read_text())
    pieces = {row['method']: 1e3 * row['position_median_m'] for row in rows['figures']['pieces']
              if row.get('restitution', .5) == .5}
    for name, accuracy in ACCURACIES.items():
        substeps = min(round(accuracy.substeps), 32)
        assert round(pieces[f'ours-{name}'], 2) == ERRORS_MM['rigid'][name]
        assert round(pieces[f'bullet-{substeps}']) == ERRORS_MM['bullet'][name]
        assert round(pieces[f'mujoco-implicitfast-{substeps}']) == ERRORS_MM['mujoco'][name]


def test_what_is_said_of_a_scene_is_not_of_the_one_before():
    """160 dolls are measured for so long that it is done each few seconds only."""
    source = SimulationSource(load_scene('pile'))
    try:
        source.request(RequestedData(frames=True))
        wait(lambda: source.status.tick_cost > 0 and source.status.measures['flights'] >= 160)
        cost = source.status.tick_cost
        source.load('flight')
        status = source.status
        # One doll has begun: at most a few ticks, of which each is a flight.
        assert not status.tick_cost > cost / 2 and status.measures['flights'] < 80
    finally:
        source.close()


def test_the_accuracy_by_the_dropdown_and_its_price(page):
    wait(lambda: ' ms. Typical error' in page.settings.cost.content)
    assert f'{ERRORS_MM["rigid"]["normal"]:g} mm' in page.settings.cost.content
    page.source.set_engine('bullet')
    wait(lambda: f'{ERRORS_MM["bullet"]["normal"]} mm' in page.settings.cost.content)
    page.source.set_engine('auto')
    wait(lambda: 'tick' in page.settings.health.figures.content)
    wait(lambda: GREEN in page.settings.health.dot.content)
    page.client.update(page.settings.accuracy, 'exact')
    wait(lambda: page.source.status.accuracy == 'exact')
    wait(lambda: f'{ERRORS_MM["rigid"]["exact"]:g} mm' in page.settings.cost.content)
    assert page.frame.scene is DROP, 'it goes on'
    page.source.load('flight')
    assert page.source.status.accuracy == 'exact'


def test_a_factor_is_typed_digit_by_digit(page, capfd):
    """0, which is none, is passed over on the way to 0.5."""
    for value in (0, 0.5):
        page.client.steer(page, f'speed {value}')
    wait(lambda: page.source.status.real_time_factor == 0.5)
    assert 'Traceback' not in capfd.readouterr().err and not page.source.status.problem


def test_gravity_and_ground_as_typed(page):
    form = page.settings.form
    page.client.update(form['gravity'], '0; 0; -1,62')
    page.client.update(form['friction'], '0.5')
    page.client.update(page.settings.ground, False)
    wait(lambda: form['gravity'].value == '0; 0; -1,62' and not page.settings.ground.value)
    page.client.update(page.settings.apply, True)
    wait(lambda: page.frame.scene is not DROP)
    scene = page.frame.scene
    assert scene.gravity == (0.0, 0.0, -1.62) and scene.material.friction == 0.5
    assert scene.ground is None and scene.dolls == DROP.dolls


def test_a_slope_falls_towards_the_front_below_the_doll(page):
    """10 degrees: on ice the doll slides by g sin(10 degrees), towards +x, as closed form."""
    form = page.settings.form
    for key, text in (('slope', '10'), ('friction', '0'), ('restitution', '0')):
        page.client.update(form[key], text)
    wait(lambda: form['slope'].value == '10' and form['restitution'].value == '0')
    page.client.update(page.settings.apply, True)
    wait(lambda: page.frame.scene is not DROP)
    scene = page.frame.scene
    angle = math.radians(10)
    assert scene.ground.normal == pytest.approx((math.sin(angle), 0, math.cos(angle)))
    middle = np.mean([placement.position for placement in scene.dolls], axis=0)
    assert scene.ground.normal @ np.array((*middle[:2], 0)) == pytest.approx(scene.ground.offset)
    masses = np.array([bone.mass for bone in scene.bones])

    def speed(frame):
        return masses @ frame.state.linear_velocities[:, 0] / masses.sum()

    wait(lambda: page.frame.time > 2.5)
    first = page.frame
    wait(lambda: page.frame.time > first.time + 0.5)
    last = page.frame
    # Along x; the doll may still roll a little on its way.
    assert (speed(last) - speed(first)) / (last.time - first.time) == pytest.approx(
        9.8 * math.sin(angle) * math.cos(angle), rel=0.05)


def test_a_ground_keeps_the_direction_in_which_it_falls():
    """At the same slope it stays as it is, to the bit."""
    ground = Ground((0.0, 0.2, 1.0), 0.3)
    scene = dataclasses.replace(DROP, ground=ground)
    assert sloping(ground, scene, slope_of(ground)) is ground
    steeper = sloping(ground, scene, 40.0)
    assert slope_of(steeper) == 40 and steeper.normal[0] == pytest.approx(0, abs=1e-12)
    assert steeper.normal[1] > 0


@pytest.mark.parametrize(('key', 'text', 'word'), [
    ('slope', '81', 'slope must be 0 to 80 °, not 81'), ('slope', '-5', 'slope must be 0 to 80'),
    ('gravity', '0 0 -1e9', 'gravity must be -1000 to 1000'),
    ('gravity', 'abc', '3 numbers'), ('friction', 'x', 'a number'),
    ('restitution', '', 'a number'), ('friction', '-1', 'friction must be 0 to inf, not -1'),
    ('restitution', '1.5', 'restitution must be 0 to 1, not 1.5')])
def test_what_cannot_be_read_is_said_beside_the_field(page, key, text, word):
    form = page.settings.form
    page.client.update(form[key], text)
    wait(lambda: form[key].value == text)
    page.client.update(page.settings.apply, True)
    wait(lambda: word in form.errors[key].content)
    assert page.source.frame.scene is DROP


def test_all_that_cannot_be_is_said_at_once(page):
    form = page.settings.form
    for key, text in (('gravity', '0 0 x'), ('friction', '-1'), ('restitution', '2')):
        page.client.update(form[key], text)
    wait(lambda: form['restitution'].value == '2')
    page.client.update(page.settings.apply, True)
    wait(lambda: all(form.errors[key].visible for key in ('gravity', 'friction', 'restitution')))
    assert page.source.frame.scene is DROP
