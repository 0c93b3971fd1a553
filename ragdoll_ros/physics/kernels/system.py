"""What the rigid core knows of a scene, what of it moves, and the room that it works in: three
tuples of arrays, bundles in compiled code.
"""
from __future__ import annotations

import collections

import numba
import numpy as np

from .compiling.bundle import bundle_type
from .dynamics.forward import Work
from .record import RECORD

GEOM = np.dtype([
    ('bone', np.int64), ('kind', np.int64), ('size', float, 3), ('offset', float, 3),
    ('turn', float, 4), ('radius', float), ('reach', float), ('friction', float),
    ('rolling', float), ('restitution', float), ('first', np.int64), ('count', np.int64)],
    align=True)
"""A part of a bone's shape. ``bone``: its record in the tree; ``offset``, ``turn``: of the shape's
centre and axes from the bone's centre of mass, along the doll's axes as bound; ``radius``: of the
ball around it; ``reach``: from the bone's centre of mass to its farthest point, m. ``friction``,
``rolling`` (m) and ``restitution``: against the ground. ``first``, ``count``: its own among all
points that may touch the ground."""

PAIR = np.dtype([('a', np.int64), ('b', np.int64), ('friction', float), ('rolling', float),
                 ('restitution', float)], align=True)
"""Two geoms that may meet, and the law of their contact."""

BOUND = np.dtype([('q', np.int64), ('v', np.int64), ('lower', float), ('upper', float)],
                 align=True)
"""A limited coordinate: where it and its velocity stand, and its bounds."""

CONTACT = np.dtype([
    ('kind', np.int64), ('a', np.int64), ('b', np.int64), ('key', np.int64), ('group', np.int64),
    ('island', np.int64), ('row', np.int64), ('support', np.int64), ('point', float, 3),
    ('arm', float, 3), ('normal', float, 3), ('across', float, (2, 3)), ('gap', float),
    ('friction', float), ('rolling', float), ('restitution', float), ('before', float),
    ('impulse', float, 5), ('begun', np.int64), ('start', float, 5)], align=True)
"""A contact of bone ``a`` (a record of the tree) with ``b`` (-1: the ground), or a joint at its
limit: ``a`` its velocity, ``normal[0]`` the sign of the way out. ``point``, where the normal force
acts, and ``arm``, where friction does, are in the world, m; ``normal`` is from b to a, ``across``
two directions along the surface. ``key`` tells it from all others at all times, ``group`` those of
one patch. ``before``: its normal velocity, m/s. ``begun``: whether it was there when the step
began, with the velocities ``start`` along its rows."""

MAX_MANIFOLD_POINTS = 8

CONTACT_POINT = np.dtype([('point', float, 3), ('normal', float, 3), ('gap', float),
                          ('feature_id', np.int64)], align=True)
"""A point midway between the surfaces, m, and the unit normal from b to a, both world; the ``gap``
along it, m, negative if the shapes overlap; an id that points of the same features keep."""

System = collections.namedtuple(
    'System', 'tree gravity up last bone_of root_of doll_of damping geoms pairs bounds normal '
    'offset bounce_speed doll_masses heft flies')
"""A scene: ``tree`` of tree.py; ``up`` (nv,): of each velocity the next one towards the root;
``last`` (n,): of each bone the last velocity that moves it; ``bone_of`` (nv,); ``root_of`` (n,):
the record of its doll's root, ``doll_of`` (n,); ``damping`` (nv,) N m s; ``normal`` (3,) and
``offset`` (1,) of the ground, offset -inf: none; ``bounce_speed`` (1,) m/s; ``doll_masses`` (d,);
``heft`` (1,) J: the weight of all times the largest reach of a geom; ``flies`` (1,): whether
damping allows flights."""

DOLL = np.dtype([('energy', float), ('kinetic', float), ('centre', float, 3),
                 ('momentum', float, 3), ('angular', float, 3), ('inertia', float, (3, 3))])
"""Sums over a doll, side by side as in Motion: energy with that of height, and its kinetic part, J;
centre of mass, m; momentum; angular momentum about that centre, and the inertia about it as if all
joints were locked."""

GIVEN = np.dtype([('impulse', float, 3), ('moment', float, 3), ('centre', float, 3),
                  ('borne', np.int64), ('meets', np.int64)], align=True)
"""What a step gives a doll from outside: impulse and its moment about the world's origin; its
``centre`` of mass before depths are given back, m; whether the ground has hold of it, and whether
another doll touches it."""

PATH = np.dtype([('valid', np.int64), ('begun', np.int64), ('along', float), ('length', float),
                 ('next', float), ('event', float), ('error', float)], align=True)
"""A path of flight: whether there is one, and whether the rates at its start are known; how far
along it all is, s; its length, s; the next one's, as its error tells; the instant of its first
touch, or infinity; its error as estimated, m or rad."""

TALLY = np.dtype([
    ('flights', np.int64), ('steps', np.int64), ('impacts', np.int64), ('sweeps', np.int64),
    ('unsolved', np.int64), ('left_out', np.int64), ('stalls', np.int64), ('softened', np.int64),
    ('gains', np.int64), ('contacts', np.int64), ('settled', np.int64), ('lasted', float),
    ('next', float), ('pushed', float), ('handed', float), ('lifted', float), ('seen', np.int64)],
    align=True)
"""What has been done since the start: paths of ``flights``, ``steps``, ``impacts``, ``sweeps``;
islands that stayed ``unsolved``, contacts ``left_out`` for want of room, searches for a touch that
came to none (``stalls``), impacts ``softened`` to make no energy, steps that made some all the
same (``gains``). Of the last step: its ``contacts``, whether it ended without a touch
(``settled``), how long it ``lasted`` and how long the ``next`` may be, s. Work of pushes and hands
and what it cost to give deep
ones back, J. ``seen``: whether the gaps are those of now."""

Course = collections.namedtuple(
    'Course', 'q v dense ends path tally within known gaps reaction rows sums loads springs')
"""What is carried on from stretch to stretch: coordinates (nq,) and velocities (nv,), those of
roots' turning along their own axes; the path of flight, its coefficients ``dense`` (8, nq + nv) and
rates of change at its ``ends`` (2, nq + nv); ``path`` and ``tally``, one record each; of the first
pairs why they do not collide: they are WITHIN each other still, as they were at the start, or a
joint in between is OUTSIDE its
limits; the contacts ``known`` from the last step; all ``gaps``, m or rad; the ``reaction`` (nv,),
accelerations that contacts gave in the last step, zero unless all of them lasted on. What comes of
a stretch: bones' ``rows`` (n, 13) and the dolls' ``sums`` (d,). What acts in it: ``loads`` (m, 11),
and ``springs`` (k, 20) of hands, drives and held joints; see engine/acting.py."""

Room = collections.namedtuple(
    'Room', 'work own composite H contacts manifold table at turn gaps later Y YT support W G p '
    'solver kinds rows mu roll need label vectors states given before after begun count lift tally '
    'within armed met above below bracket stages row place blocks unsought left')
"""Scratch of the rigid core, but for ``tally``, ``within`` and ``gaps``, which are the course's.

The rows ``Y`` of contacts have entries for the velocities that they see, ``support``, alone, and
the columns of ``YT`` for all; ``W`` and ``G`` have room for a small island, ``blocks`` for W of
each contact by itself. Of a step: ``met``, the gaps that tell what touches in it; ``bracket``,
``above`` and ``below`` of stepping/touch.py; ``unsought`` (1,), whether touches in it are not
sought; ``left`` (1,), m/s by which contacts of large islands may err."""

WITHIN, OUTSIDE = 1, 2

HAND, MOVES, TURNS, HOLDS = 0, 1, 2, 3
"""What a spring is: a hand's; of a drive what damps its bone's velocity or its turning; a hold of a
joint's angle."""

COMPLIANCE, OF_IMPACTS = 1e-8, 1e-10
"""Of contacts and limits, as a share of their own W, in steps and at impacts: what several of them
bear together is then decided, and their impulses stay small where they jam. What rests on a slope
creeps by some 1e-10 m/s for it, and what strikes misses as large a share of its velocity."""

LARGE = 96
"""Rows of an island from which on it is solved without W; see impulses/large_island.py."""

STICKS = 1e5
"""Coefficient from which friction has no limit."""

VECTORS, STATES = 8, 6


def make_course(system: System, contacts: int = 0) -> Course:
    """At the origin, at rest, with room for so many contacts."""
    nv = len(system.up)
    nq = nv + int(system.tree['free'].sum())
    return Course(
        q=np.zeros(nq), v=np.zeros(nv), dense=np.zeros((8, nq + nv)), ends=np.zeros((2, nq + nv)),
        path=np.zeros(1, PATH), tally=np.zeros(1, TALLY),
        within=np.zeros(len(system.pairs), np.int64), known=np.zeros(contacts, CONTACT),
        gaps=np.zeros(count_gaps(system)), reaction=np.zeros(nv),
        rows=np.zeros((len(system.tree), 13)), sums=np.zeros(len(system.doll_masses), DOLL),
        loads=np.zeros((0, 11)), springs=np.zeros((0, 20)))


def count_gaps(system: System) -> int:
    """Of points above the ground, of joints to both of their limits, and of pairs."""
    return int(system.geoms['count'].sum()) + 2 * len(system.bounds) + len(system.pairs)


def make_room(system: System, course: Course) -> Room:
    """Room for a course of a system, for as many contacts as the course knows at the most."""
    bones, nv = len(system.tree), len(system.up)
    nq = nv + int(system.tree['free'].sum())
    geoms, dolls = len(system.geoms), len(system.doll_masses)
    contacts = len(course.known)
    rows = contacts * (5 if max(system.geoms['rolling'].max(initial=0.0),
                                system.pairs['rolling'].max(initial=0.0)) > 0 else 3)
    gaps, wide, few = len(course.gaps), min(nv, 2 * depth(system)) + 1, min(rows, LARGE)
    work = Work(np.zeros((bones, 4)), np.zeros((bones, 3)), np.zeros((bones, 6)),
                np.zeros((nv, 6)), np.zeros((bones, 6, 6)), np.zeros((bones, 6)),
                np.zeros((nv, 6)), np.zeros((nv, 8)), np.zeros((3, 3)))
    return Room(
        work=work, own=np.zeros((bones, 6)), composite=np.zeros((bones, 10)),
        H=np.zeros((nv, nv)), contacts=np.zeros(contacts, CONTACT),
        manifold=np.zeros(MAX_MANIFOLD_POINTS, CONTACT_POINT), table=np.zeros((16, 8)),
        at=np.zeros((geoms, 3)), turn=np.zeros((geoms, 3, 3)), gaps=course.gaps,
        later=np.zeros(gaps), Y=np.zeros((rows, wide)), YT=np.zeros((nv, few)),
        support=np.zeros((contacts, wide), np.int64), W=np.zeros(few * few),
        G=np.zeros(few * few), p=np.zeros((6, rows)),
        solver=np.zeros((8, 2 * max(rows, 8))), kinds=np.zeros(contacts, np.int64),
        rows=np.zeros(contacts, np.int64), mu=np.zeros(contacts), roll=np.zeros(contacts),
        need=np.zeros((4, contacts)), label=np.zeros(dolls, np.int64),
        vectors=np.zeros((VECTORS, nv)), states=np.zeros((STATES, nq)),
        given=np.zeros(dolls, GIVEN), before=np.zeros(dolls, DOLL), after=np.zeros(dolls, DOLL),
        begun=np.zeros(contacts, CONTACT), count=np.zeros(1, np.int64), lift=np.zeros(2),
        tally=course.tally, within=course.within, armed=np.zeros(gaps), met=np.zeros(gaps),
        above=np.zeros(gaps), below=np.zeros(gaps), bracket=np.zeros(5),
        stages=np.zeros((16, nq + nv)), row=np.zeros(nq + nv),
        place=np.zeros(nv, np.int64), blocks=np.zeros((contacts, 25)),
        unsought=np.zeros(1), left=np.zeros(1))


def depth(system: System) -> int:
    """Most velocities that move one bone."""
    most = 0
    for j in system.last:
        size = 0
        while j >= 0:
            size, j = size + 1, system.up[j]
        most = max(most, size)
    return most


def blank() -> System:
    """A system of one bone and nothing else: what is compiled is compiled for its types."""
    return System(
        tree=np.zeros(1, RECORD), gravity=np.zeros(3), up=np.arange(6) - 1,
        last=np.zeros(1, np.int64), bone_of=np.zeros(6, np.int64),
        root_of=np.zeros(1, np.int64), doll_of=np.zeros(1, np.int64), damping=np.zeros(6),
        geoms=np.zeros(1, GEOM), pairs=np.zeros(1, PAIR), bounds=np.zeros(1, BOUND),
        normal=np.zeros(3), offset=np.zeros(1), bounce_speed=np.zeros(1),
        doll_masses=np.zeros(1), heft=np.zeros(1), flies=np.zeros(1))


SYSTEM = bundle_type(blank())
COURSE = bundle_type(make_course(blank()))
ROOM = bundle_type(make_room(blank(), make_course(blank())))
DOLLS = numba.from_dtype(DOLL)[::1]
