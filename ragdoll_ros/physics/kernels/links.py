"""Links of a robot: where its joints take them, by forward kinematics, and the twists to get there;
set_twists() sets those of all that follows exactly.

Times are whole numbers of ns. Poses are rows (7,), world frame: position, m, quaternion x, y, z, w.
"""
from __future__ import annotations

import collections
import math

import numpy as np

from .compiling.bundle import bundle_at, bundle_type
from .compiling.decorators import ADDRESS, REAL, compiled, entry, type_like
from .dynamics.kinematics import put_quat
from .maths.transcendental import arc, sine_and_cosine
from .maths.vectors import (Quat, Vec3, add, add_scaled, divide, norm, put, quat, quat_conj,
                            quat_mul, quat_rotate, quat_rotate_inverse, scale, sub, vec)

SECOND = 1_000_000_000
"""ns"""

ROUNDING = 1e-12
"""m or rad: what is nearer to where it should be is there."""

NEVER = -1
"""Before all times."""

LINK_JOINT = np.dtype([
    ('parent', np.int64), ('leader', np.int64), ('multiplier', float), ('offset', float),
    ('slides', np.int64), ('position', float, 3), ('orientation', float, 4),
    ('half_turn', float, 4), ('axis', float, 3)], align=True)
"""A joint of a tree. parent: 0 for the robot's frame, i + 1 for that of the child of joint i.
leader: the driven joint that it follows, as multiplier * value + offset, or -1. slides: along
``axis``, else it turns. position, m, and orientation: of its child's frame at zero; half_turn: its
orientation after half a turn; all in the parent's frame."""

JOINT_MOTION = np.dtype([
    ('value', float), ('rate', float), ('begin', float), ('since', np.int64), ('end', np.int64),
    ('approach_end', np.int64), ('told', np.int64), ('continuous', np.int64)], align=True)
"""Motion of a driven joint. value, rad or m, that it was told at the time ``since``, from where it
goes on at its rate until ``end``. begin: where it was then, from where it gets to that motion until
``approach_end``. told: whether it ever was. continuous: whether a whole turn changes nothing."""

Links = collections.namedtuple(
    'Links', 'joints motions frames place bones reach poses twists changed')
"""A robot of n links, j joints and k driven joints. ``joints`` (j,), parents first; ``motions``
(k,). ``frames`` (j + 1, 7): scratch. Of each link: ``place`` (n,) of its frame in ``frames``;
``bones`` (n,) in the scene; ``reach`` (n,) m, of its farthest point; ``poses`` (n, 7); ``twists``
(n, 6) that the engine has, m/s and rad/s, infinite: unknown, and which ``changed`` (n,) in the
last call."""


def make_links(joints: np.ndarray, motions: np.ndarray, place: np.ndarray, reach: np.ndarray,
               bones: np.ndarray) -> Links:
    """Make the Links of a robot from its tables, see Links. Poses are zero and twists infinite
    (unknown).
    """
    n = len(place)
    return Links(joints, motions, np.zeros((len(joints) + 1, 7)), place, bones, reach,
                 np.zeros((n, 7)), np.full((n, 6), np.inf), np.zeros(n, np.bool_))


LINKS = bundle_type(make_links(np.zeros(0, LINK_JOINT), np.zeros(0, JOINT_MOTION),
                               np.zeros(0, np.int64), np.zeros(0), np.zeros(0, np.int64)))

links_at = bundle_at(LINKS)

INTEGER, INDICES, ROW, ROWS = (type_like(each) for each in (
    0, np.zeros(0, np.int64), np.zeros(0), np.zeros((0, 0))))


@compiled
def value_at(motion: np.record, time: int) -> float:
    """Return the value of a driven joint, rad or m, at ``time``, ns: linear from motion.begin to
    the motion until approach_end, then by motion.value and rate, constant from motion.end on.
    """
    if time < motion.approach_end:
        span = motion.approach_end - motion.since
        goal = motion.value + span / SECOND * motion.rate
        return motion.begin + (time - motion.since) / span * (goal - motion.begin)
    return motion.value + (min(time, motion.end) - motion.since) / SECOND * motion.rate


@compiled
def arrival(motion: np.record) -> int:
    """Return the time, ns, from which on a joint is at rest."""
    return max(motion.approach_end, motion.end) if motion.rate != 0.0 else motion.approach_end


@compiled
def place_links(links: Links, frame: np.ndarray, time: int) -> None:
    """Write the poses of all links at ``time``, when the robot's ``frame`` is at a pose (7,)."""
    root = links.frames[0]
    for k in range(7):
        root[k] = frame[k]
    for i in range(len(links.joints)):
        joint, value = links.joints[i], 0.0
        if joint.leader >= 0:
            value = joint.multiplier * value_at(links.motions[joint.leader], time) + joint.offset
        at, turn = vec(joint.position), quat(joint.orientation)
        if joint.slides:
            at = add_scaled(at, value, vec(joint.axis))
        else:
            sine, cosine = sine_and_cosine(value / 2)
            (a, b, c, d), (e, f, g, h) = turn, quat(joint.half_turn)
            turn = (cosine * a + sine * e, cosine * b + sine * f, cosine * c + sine * g,
                    cosine * d + sine * h)
        parent, own = links.frames[joint.parent], links.frames[i + 1]
        carrier = quat(parent[3:7])
        put(own, add(vec(parent), quat_rotate(carrier, at)))
        put_quat(own[3:7], quat_mul(carrier, turn))
    for link in range(len(links.place)):
        for k in range(7):
            links.poses[link, k] = links.frames[links.place[link], k]


@compiled
def rotation_vector(turn: Quat) -> Vec3:
    """Rotation vector, rad, of a unit quaternion x, y, z, w; its angle is at most pi."""
    x, y, z, w = turn if turn[3] >= 0 else (-turn[0], -turn[1], -turn[2], -turn[3])
    sine = norm((x, y, z))
    return scale(2 * arc(sine, w) / sine if sine > ROUNDING else 2.0, (x, y, z))


@compiled
def displacement(link: int, links: Links, states: np.ndarray) -> tuple[Vec3, Vec3]:
    """Return the translation, m, and the rotation vector, rad, both in the world frame, that take a
    link from its pose in ``states`` (n, 13) to links.poses.
    """
    state, pose = states[links.bones[link]], links.poses[link]
    return sub(vec(pose), vec(state)), rotation_vector(
        quat_mul(quat(pose[3:7]), quat_conj(quat(state[3:7]))))


@entry(ADDRESS, ROW, ROWS, INTEGER, INTEGER, INTEGER, ROWS, REAL)
def set_joint_targets(address: int, frame: np.ndarray, told: np.ndarray, time: int, arrive: int,
                      end: int, states: np.ndarray, leap: float) -> tuple[bool, bool, int]:
    """Set the targets of driven joints from ``time`` until ``end``, ns. ``told`` (2, k): values,
    rad or m, and rates; NaN: not given. Joints with neither are not changed. Without a rate, a
    joint stays at the value; without a value, it moves on from where it is. A continuous joint
    turns the shorter way. The target is the value plus the rate times the time since ``time``;
    joints reach it at ``arrive``, ns. But if that may move a point of a link by more than ``leap``
    m, the robot jumps: the joints are at their targets at once, and the caller must place the robot
    there. Writes to links.poses the poses at ``time``, with the values reached at once. ``frame``
    (7,): pose of the robot; ``states`` (n, 13): of all bones.

    Returns whether the robot jumps, whether a joint with a new target had one before, and the time,
    ns, from which on all joints are at rest.
    """
    links, told_before, farthest, latest = links_at(address), False, 0.0, NEVER
    motions, values, rates = links.motions, told[0], told[1]
    for k in range(len(motions)):
        motion, value, rate = motions[k], values[k], rates[k]
        if math.isnan(value) and math.isnan(rate):
            continue
        begin = value_at(motion, time)
        if math.isnan(value):
            value = begin
        elif motion.continuous:
            # It turns the shorter way.
            begin += math.floor((value - begin) / (2 * math.pi) + 0.5) * 2 * math.pi
        told_before |= motion.told != 0
        motion.begin, motion.value, motion.since, motion.end = begin, value, time, end
        motion.rate = 0.0 if math.isnan(rate) else rate
        motion.approach_end, motion.told = NEVER, 1
    place_links(links, frame, time)
    for link in range(len(links.place)):
        translation, turn = displacement(link, links, states)
        farthest = max(farthest, norm(translation) + links.reach[link] * norm(turn))
    for k in range(len(motions)):
        if farthest <= leap and abs(values[k] - motions[k].begin) > ROUNDING:
            motions[k].approach_end = arrive
        latest = max(latest, arrival(motions[k]))
    return farthest > leap, told_before, latest


@entry(ADDRESS, ROW, INTEGER, INTEGER, ROWS)
def change_twists(address: int, frame: np.ndarray, time: int, end: int,
                  states: np.ndarray) -> int:
    """Write to links.twists the constant twists that take all links from their poses in ``states``
    (n, 13) at ``time`` to those at ``end``, ns, when the robot's ``frame`` is at a pose (7,).
    Twists that differ from the last ones by rounding are kept. Marks those that changed in
    links.changed and returns their number. Writes links.poses, at ``end``.
    """
    links, seconds = links_at(address), (end - time) / SECOND
    bound, count = ROUNDING / seconds, 0
    place_links(links, frame, end)
    for link in range(len(links.place)):
        own, least, most = links.twists[link], 0.0, 0.0
        translation, turn = displacement(link, links, states)
        twist = divide(translation, seconds) + divide(turn, seconds)
        for k in range(6):
            least = max(least, abs(twist[k]))
        for k in range(6):
            value = twist[k] if least > bound else 0.0
            most = max(most, abs(value - own[k]))
        links.changed[link] = most > bound
        if most > bound:
            count += 1
            for k in range(6):
                own[k] = twist[k] if least > bound else 0.0
    return count


@entry(ADDRESS, INTEGER, INTEGER)
def next_joint_change(address: int, time: int, end: int) -> int:
    """Earliest time, ns, after ``time`` and before ``end`` at which the approach or the motion of a
    joint ends; else ``end``. ``address``: see links_at().
    """
    links = links_at(address)
    for k in range(len(links.motions)):
        motion = links.motions[k]
        for change in (motion.approach_end, motion.end):
            if time < change < end:
                end = change
    return end


@entry(ROW, ROW, ROWS, INDICES, INDICES, INDICES, INDICES, ROWS)
def set_twists(q: np.ndarray, v: np.ndarray, states: np.ndarray, first_q: np.ndarray,
               first_v: np.ndarray, first_bone: np.ndarray, dolls: np.ndarray,
               twists: np.ndarray) -> None:
    """Write the ``twists`` (m, 6), linear part first, world frame, of ``dolls`` (m,) of one bone to
    v and to the states (n, 13) of a scene. In v the angular part is in the bone's own frame, by its
    orientation in q. Coordinates, velocities and states of doll d begin at first_q[d], first_v[d]
    and first_bone[d].
    """
    for k in range(len(dolls)):
        doll, twist = dolls[k], twists[k]
        at, own, state = first_q[doll] + 3, first_v[doll], states[first_bone[doll]]
        put(v[own:own + 3], vec(twist))
        put(v[own + 3:own + 6], quat_rotate_inverse(quat(q[at:at + 4]), vec(twist[3:])))
        for j in range(6):
            state[7 + j] = twist[j]
