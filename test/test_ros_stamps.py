"""Stamps against ROS time: on a made-up clock, in a node, and over stalls of a whole process."""
from __future__ import annotations

import signal
import time

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import PoseArray
from peer import PATIENCE, end, kill, start
from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter
from rosgraph_msgs.msg import Clock
from std_srvs.srv import SetBool, Trigger

from ragdoll_ros.ros.messages.convert import to_time
from ragdoll_ros.ros.stamps import MAX_DRIFT, MAX_READ_TIME, Stamps

SECOND = 1_000_000_000
TICK = 10_000_000


class Clocks:
    """ROS time and a steady clock as a test sets them, ns, and stamps that go by them."""

    def __init__(self, ros, steady=0):
        self.ros, self.steady = ros, steady
        self.stamps = Stamps(lambda: self.ros, lambda: self.steady)

    def go(self, span):
        self.ros += span
        self.steady += span

    def stamp(self, due=None):
        self.stamps.advance(due)
        return self.stamps.latest


def test_a_stamp_is_the_ros_time_at_which_the_state_was_due():
    clocks = Clocks(5 * SECOND)
    found = []
    for tick in range(1, 100):
        clocks.go(TICK)
        clocks.ros += (-1) ** tick * MAX_DRIFT // 4  # a clock is never read at the very instant
        found.append(clocks.stamp(tick * TICK))
    assert found == [5 * SECOND + tick * TICK for tick in range(1, 100)]
    clocks.go(3 * SECOND)
    assert clocks.stamp() == pytest.approx(clocks.ros, abs=MAX_DRIFT)


def test_a_reading_between_which_others_had_the_processor_moves_nothing():
    clocks = Clocks(5 * SECOND)
    looks = iter([TICK, TICK + 10 * MAX_READ_TIME + 2 * MAX_DRIFT])
    clocks.ros += TICK
    clocks.stamps._steady = lambda: next(looks)
    assert clocks.stamp(TICK) == 5 * SECOND + TICK


@pytest.mark.parametrize('step, stays', [(2 * TICK, False), (-SECOND // 2, True)])
def test_a_clock_that_is_set_is_followed_and_stamps_never_go_back(step, stays):
    clocks = Clocks(5 * SECOND)
    before = clocks.stamp()
    clocks.ros += step
    clocks.go(TICK)
    assert clocks.stamp() == (before + 1 if stays else clocks.ros)
    clocks.go(SECOND)
    assert clocks.stamp() == clocks.ros


@pytest.mark.parametrize('first', [50, 504_770_000_000], ids=['behind', 'ahead'])
def test_stamps_begin_with_ros_time_also_where_it_begins_later(first):
    """A /clock that comes after the node; one that begins anew, as a recording's in a loop."""
    clocks = Clocks(0)
    assert [clocks.stamp(due) for due in (TICK, 2 * TICK, 9 * SECOND)] == [
        TICK, 2 * TICK, 9 * SECOND]
    clocks.ros, clocks.steady = first, 10 * SECOND
    assert clocks.stamp() == first
    clocks.go(5 * SECOND)
    assert clocks.stamp() == first + 5 * SECOND
    clocks.ros = 7
    assert clocks.stamp() == 7


def stamp_of(message):
    stamp = message.clock if isinstance(message, Clock) else message.header.stamp
    return stamp.sec * SECOND + stamp.nanosec


def lateness(got, begun):
    """How late messages came, ns, whose clock has been 504 s at ``begun`` ns."""
    return np.array([504 * SECOND + int(arrival * 1e9) - begun - stamp_of(message)
                     for arrival, message in got if stamp_of(message) >= 504 * SECOND])


def test_stamps_are_those_of_a_clock_that_another_tells(make_node, peer):
    """A /clock is heard after the node has begun, as it can not be before.

    It stands, so that no machine is too busy to read it in time: stamps come up to it, each by as
    much as its tick is late, and then go on by 1 ns. What they may be ahead is some readings that
    were not used, as another thread had the processor.
    """
    node = make_node(use_sim_time=True)
    got = peer.collect(PoseArray, 'ragdoll/poses')
    clock, now = peer.sender(Clock, '/clock'), [504 * SECOND + SECOND // 2]
    peer.wait_heard(node, '/ragdoll/poses')
    peer.executor_.add_node(node)
    peer.create_timer(0.01, lambda: clock.publish(Clock(clock=to_time(now[-1]))))
    for _ in range(2):
        peer.wait(lambda: got and stamp_of(got[-1][1]) > now[-1] - 3 * TICK)
        count = len(got)
        peer.wait(lambda count=count: len(got) > count + 100)
        assert stamp_of(got[-1][1]) < now[-1] + SECOND // 2
        report = peer.hear_once(DiagnosticArray, '/diagnostics')
        assert now[-1] - SECOND < stamp_of(report) <= now[-1]
        now.append(now[-1] + 100 * SECOND)
    stamps = [stamp_of(message) for _, message in got if stamp_of(message) >= 504 * SECOND]
    assert min(np.diff(stamps)) > 0


@pytest.mark.slow
def test_stamps_are_as_late_as_a_clock_that_another_tells(make_node, peer):
    """What this process tells itself is as late, where that is later than three ticks."""
    node = make_node(use_sim_time=True)
    got = peer.collect(PoseArray, 'ragdoll/poses')
    clock, echoes = peer.sender(Clock, '/clock'), peer.collect(Clock, '/clock')
    peer.wait_heard(node, '/ragdoll/poses')
    peer.executor_.add_node(node)
    begun = time.monotonic_ns()

    def told():
        return 504 * SECOND + time.monotonic_ns() - begun

    peer.create_timer(0.01, lambda: clock.publish(Clock(clock=to_time(told()))))
    peer.wait(lambda: sum(stamp_of(message) >= 504 * SECOND for _, message in got) > 100)
    stamps = [stamp_of(message) for _, message in got if stamp_of(message) >= 504 * SECOND]
    assert min(np.diff(stamps)) > 0
    late, echoed = lateness(got, begun), lateness(echoes, begun)
    assert abs(np.median(late[-100:])) < max(3 * TICK, 3 * np.median(echoed[-100:]))
    reports = peer.collect(DiagnosticArray, '/diagnostics')
    peer.wait(lambda: reports)
    assert 504 * SECOND <= stamp_of(reports[0][1]) <= told()


class Heard:
    """The stamps of a node's poses, and how late each came, ns; WARN messages of /diagnostics.

    Beside them how late an empty timer of this process is, ns: what a busy machine does to it, it
    does to each of the four threads on a pose's way, the node's two and this process' two.
    """

    def __init__(self, peer):
        self.peer, self.stamps, self.late, self.warnings = peer, [], [], []
        self.timer_late, self._timer_at = [], time.monotonic_ns()
        peer.create_timer(TICK / SECOND, self._time)
        peer.create_subscription(PoseArray, 'ragdoll/poses', self._take, 1000)
        peer.create_subscription(DiagnosticArray, '/diagnostics', self._judge, 10)

    def _take(self, message):
        self.stamps.append(stamp_of(message))
        self.late.append(time.time_ns() - self.stamps[-1])

    def _time(self):
        now = time.monotonic_ns()
        self.timer_late.append(max(now - self._timer_at - TICK, 0))
        self._timer_at = now

    def bound(self, spacing, share):
        """How late that share of poses may be, ns: a spacing, or what the last timers were late."""
        return max(spacing, 4 * np.quantile(self.timer_late[-100:], share))

    def _judge(self, message):
        self.warnings += [status.message for status in message.status
                          if status.level == DiagnosticStatus.WARN]

    def next(self, count):
        """Give the stamps that come from now on, and how late they are."""
        begin = len(self.stamps)
        self.peer.wait(lambda: len(self.stamps) >= begin + count)
        return np.array(self.stamps[begin:]), np.array(self.late[begin:])

    def are_on_time(self, spacing, count=100, spaced=0.95, in_time=0.8):
        """Whether stamps come of which such shares are equally spaced, and due within a tick.

        Others may take the machine's time away.
        """
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            stamps, late = self.next(count)
            if (np.mean(np.diff(stamps) == spacing) > spaced
                    and np.mean(np.abs(late) < self.bound(spacing, 0.95)) > in_time):
                return True
        return False

    def are_on_time_once(self, spacing):
        """Whether ten stamps come of which most are equally spaced, and one at least in time."""
        return self.are_on_time(spacing, 10, spaced=0.5, in_time=0)


@pytest.fixture
def heard(ros, peer):
    process = start('node', compiled=True)
    heard = Heard(peer)
    heard.process = process
    peer.wait(lambda: len(heard.stamps) > 50)
    yield heard
    try:
        end(process, signal.SIGINT)
    finally:
        kill(process)


def caught_up_over_stalls_paces_pauses_and_resets(heard, peer, are_on_time):
    """Stamps are ROS time; how late those after a stall are, from a second after it on, ns."""
    assert are_on_time(TICK)

    heard.process.send_signal(signal.SIGSTOP)
    stopped = time.monotonic()
    peer.wait(lambda: time.monotonic() > stopped + 3)
    heard.warnings.clear()
    count = len(heard.stamps)
    heard.process.send_signal(signal.SIGCONT)
    peer.wait(lambda: any('below the requested' in each or 'dropped' in each
                          for each in heard.warnings))
    peer.wait(lambda: len(heard.stamps) > count + 200)
    # From a second after the stall on; what the process had sent before it is not counted.
    first = np.argmax(np.diff(heard.stamps[count - 10:])) + count - 9
    caught_up = np.array(heard.late[first:])[
        np.array(heard.stamps[first:]) > heard.stamps[first] + SECOND]
    bound = heard.bound(TICK, 0.95)
    assert are_on_time(TICK)

    for pace in (0.5, 2.0):
        request = SetParameters.Request(parameters=[
            Parameter('real_time_factor', value=pace).to_parameter_msg()])
        assert peer.call(SetParameters, 'ragdoll/set_parameters', request).results[0].successful
        heard.next(10)
        assert are_on_time(round(TICK / pace))

    assert peer.call(SetBool, 'ragdoll/pause', SetBool.Request(data=True)).success
    paused = time.monotonic()
    peer.wait(lambda: time.monotonic() > paused + 1)
    count = len(heard.stamps)
    assert peer.call(SetBool, 'ragdoll/pause', SetBool.Request(data=False)).success
    # Some from before the pause may come after its answer.
    peer.wait(lambda: len(heard.stamps) > count
              and max(np.diff(heard.stamps[count - 1:])) > SECOND // 2)
    assert are_on_time(TICK // 2)

    assert peer.call(Trigger, 'ragdoll/reset', Trigger.Request()).success
    heard.next(10)
    assert are_on_time(TICK // 2)
    assert min(np.diff(heard.stamps)) > 0
    return caught_up, bound


def test_stamps_are_ros_time_over_stalls_paces_pauses_and_resets(heard, peer):
    caught_up_over_stalls_paces_pauses_and_resets(heard, peer, heard.are_on_time_once)


@pytest.mark.slow
def test_stamps_are_on_time_over_stalls_paces_pauses_and_resets(heard, peer):
    late, bound = caught_up_over_stalls_paces_pauses_and_resets(heard, peer, heard.are_on_time)
    assert np.median(late) < bound


def test_a_change_of_the_pace_is_no_stall(make_node, peer):
    """No report compares a mean over the time before with what is wanted now.

    It would each time; a machine that is too busy for that pace falls below it now and then.
    """
    node = make_node(scene='flight', rate=20.0)
    reports = peer.collect(DiagnosticArray, '/diagnostics')
    peer.executor_.add_node(node)

    def pace(value):
        node.set_parameters([Parameter('real_time_factor', value=value)])

    def no_stall_by(change):
        peer.wait(lambda: reports)
        change()
        reports.clear()
        peer.wait(lambda: len(reports) > 2)
        return not any('below the requested 4' in report.status[0].message
                       for _, report in reports[:2])

    for before, change in ((lambda: pace(1), lambda: pace(4)),
                           (lambda: node.pause(False), lambda: node.pause(True)),
                           (lambda: node.pause(True), lambda: node.pause(False))):
        for _ in range(10):
            if no_stall_by(change):
                break
            before()
        else:
            pytest.fail('a change is taken for a stall')


def test_overload_lowers_the_pace_and_stamps_stay_ros_time(make_node, peer):
    """A hundred times as fast as life in ticks of 0.2 ms, which no machine here can do."""
    node = make_node(rate=5000.0, real_time_factor=100.0)
    heard, reports = Heard(peer), peer.collect(DiagnosticArray, '/diagnostics')
    peer.executor_.add_node(node)
    peer.wait(lambda: len(reports) > 3)
    stamps, _ = heard.next(200)
    lag = time.time_ns() - node.stamp
    assert min(np.diff(stamps)) > 0 and lag < SECOND
    values = {pair.key: pair.value for pair in reports[-1][1].status[0].values}
    assert float(values['pace']) < 100 and int(values['dropped_ticks']) > 0
    assert float(values['lost_time']) > 0 and float(values['stamp_lag_ms']) < 1000
    assert 'below the requested' in reports[-1][1].status[0].message
    assert 'dropped' in reports[-1][1].status[0].message


@pytest.mark.parametrize('rate', [20.0, 100.0, 240.0])
def test_after_stalls_no_stamp_lies_in_the_future(make_node, peer, rate):
    """Four stalls of more than 0.5 s that end in any phase of a tick; before, after half of them
    stamps lay up to half a period ahead until the next one.
    """
    node, ahead = make_node(scene='flight', rate=rate), []
    make_tick = node.ticker._tick

    def tick(due):
        ahead.append(due - time.monotonic_ns())
        make_tick(due)
        if len(ahead) % 8 == 0 and len(ahead) <= 32:
            time.sleep(0.52 + 0.23 * len(ahead) / 8 / rate)  # the stall

    node.ticker._tick = tick
    peer.executor_.add_node(node)
    peer.wait(lambda: len(ahead) > 40)
    # What is due is never early by more than a timer's rounding.
    assert max(ahead) < 1e6


@pytest.mark.parametrize('phase', [0.55, 0.66, 0.9])
def test_a_timer_that_comes_late_makes_no_tick_early(make_node, peer, phase):
    """After a stall the timer begins anew once the first tick is made, here so much of a period
    late; then a tick takes a period and a half. Before, the last but one after it came early.
    """
    node, ahead = make_node(scene='flight', rate=100.0), []
    make_tick, pauses = node.ticker._tick, {8: 0.53, 9: phase / 100, 14: 0.015}

    def tick(due):
        ahead.append(due - time.monotonic_ns())
        make_tick(due)
        time.sleep(pauses.get(len(ahead), 0.0))

    node.ticker._tick = tick
    peer.executor_.add_node(node)
    peer.wait(lambda: len(ahead) > 24)
    assert max(ahead) < 1e6
    assert node.ticker.dropped_ticks > 0
