"""Advance all chains of a scene over a grid of time, root to tip.

The state at a time between two points of the grid is one shorter step from the last of them, which
is then discarded: a state depends on the start, the time and the bones' motion, not on which other
times were asked for.
"""
from __future__ import annotations

import math

import numpy as np

from ..compiling.decorators import compiled, entry, inlined, type_like
from ..maths.vectors import Vec3, dot, put, vec
from .bone_path import set_bones
from .collide import advance_among
from .colliders import move_out
from .link_step import (limited, outward, root_forces, root_frame, set_frame, set_response,
                        step_link, tip_frame)
from .links import COLLIDER, LINK, LINK_STATE, RESPONSE, Around, Chains, Frame

MAX_SUBSTEPS = 64

CHAINS = type_like(Chains(
    np.zeros(0, LINK), np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(0, RESPONSE),
    np.zeros(0, RESPONSE), np.zeros((0, 13)), np.zeros(0, COLLIDER), np.zeros(0, np.int64),
    np.zeros(0, np.int64), np.zeros(0, LINK_STATE)))
LINKS, STATES, RESPONSES = (type_like(np.zeros(0, kind)) for kind in (LINK, LINK_STATE, RESPONSE))
KNOTS, BONES, ROWS = (type_like(np.zeros((0,) * dimensions)) for dimensions in (1, 2, 3))
NUMBER, INDEX, FLAG = (type_like(value) for value in (0.0, 0, False))


@compiled
def bone_at(time: float, knots: np.ndarray, rows: np.ndarray, bone: int) -> np.ndarray:
    """State (13,) of one bone; see set_bones()."""
    out = np.empty((1, 13))
    set_bones(time, knots, rows[:, bone:bone + 1], out)
    return out[0]


@compiled
def substep_count(forces: tuple[Vec3, Vec3], r: np.ndarray) -> int:
    """Number of substeps, up to MAX_SUBSTEPS, of a step of response ``r``, so that the phase of a
    pendulum in a substep, its length times sqrt(f), is at most LARGEST_FORCED_PHASE. f: the larger
    size of the ``forces``, 1/s^2, at both ends of the step.
    """
    square = max(dot(forces[0], forces[0]), dot(forces[1], forces[1]))
    if square <= r.largest_square:
        return 1
    substeps = math.ceil(math.sqrt(math.sqrt(square / r.largest_square)))
    return min(int(substeps), MAX_SUBSTEPS)


@inlined
def step_chain(links: np.ndarray, responses: np.ndarray, states: np.ndarray, start: int, stop: int,
               frame: Frame, forces: tuple[Vec3, Vec3], most: float) -> None:
    """Integrate the links from ``start`` to ``stop`` (excluded) over one step. ``frame``: at the
    first root at the step's end; ``forces``, 1/s^2: on the first link at the step's start and end.

    The rates of all links but the first, and the spins of the frames at their roots, are limited to
    ``most`` rad/s; callers give half a turn in an interval of the grid. The next link cannot
    resolve faster turns, and an undamped chain would gain energy from aliasing without end.
    """
    step_link(links[start], responses[start], states[start], frame, forces)
    for k in range(start + 1, stop):
        link, state, r = links[k], states[k], responses[k]
        frame = tip_frame(links[k - 1], states[k - 1], most)
        step_link(link, r, state, frame, root_forces(link, r, state, frame))
        put(state.rate, limited(vec(state.rate), most))


@compiled
def part_step(links: np.ndarray, responses: np.ndarray, states: np.ndarray, start: int, stop: int,
              frame: Frame, most: float) -> None:
    """Integrate a chain over one substep of a divided step. ``responses``: to the substep;
    ``frame``: at the first root at its end.
    """
    forces = root_forces(links[start], responses[start], states[start], frame)
    step_chain(links, responses, states, start, stop, frame, forces, most)


@entry(LINKS, NUMBER, RESPONSES)
def set_responses(links: np.ndarray, h: float, responses: np.ndarray) -> None:
    """Write the responses (m,) of links to a step of ``h`` s."""
    for k in range(len(links)):
        set_response(links[k], h, responses[k])


@entry(NUMBER, KNOTS, ROWS, BONES)
def bones_at(time: float, knots: np.ndarray, rows: np.ndarray, out: np.ndarray) -> None:
    """Write the states (b, 13) of bones at ``time`` s: set_bones() for callers outside compiled
    code.
    """
    set_bones(time, knots, rows, out)


@entry(CHAINS, STATES, BONES, FLAG, FLAG)
def begin_chains(chains: Chains, states: np.ndarray, bones: np.ndarray, has_directions: bool,
                 has_rates: bool) -> None:
    """Start the links (m,) of all chains on bones (b, 13) and write their ``states``. All links
    keep the directions in ``states`` if ``has_directions``, and the rates there if ``has_rates``;
    else they begin in their rest directions, and at rest relative to their frames. Tips inside
    colliders are moved out.
    """
    matrix = np.empty((3, 3))
    chain = -1
    for k in range(len(states)):
        link, state = chains.links[k], states[k]
        if link.parent < 0:
            chain += 1
            frame = root_frame(link, bones[link.bone], matrix)
        else:
            frame = tip_frame(chains.links[link.parent], states[link.parent], math.inf)
        d = vec(state.direction) if has_directions else outward(frame, vec(link.rest))
        set_frame(link, state, frame, d)
        if not has_rates:
            put(state.rate, vec(state.drift))
        if chains.firsts[chain] < chains.lasts[chain]:
            move_out(link, state, frame, Around(chains.colliders, chains.firsts[chain],
                                                chains.lasts[chain], bones, bones, True))


@entry(CHAINS, STATES, KNOTS, ROWS, NUMBER, INDEX, INDEX, NUMBER)
def advance_chains(chains: Chains, states: np.ndarray, knots: np.ndarray, rows: np.ndarray,
                   origin: float, begin: int, end: int, h: float) -> None:
    """Integrate from the instant ``origin`` + ``begin`` h to ``origin`` + ``end`` h, in intervals
    of ``h`` s.
    """
    matrix = np.empty((3, 3))
    # Locals, as each array that is taken from a tuple is counted.
    links, starts, ends, roots = chains.links, chains.starts, chains.ends, chains.roots
    responses, part_responses = chains.responses, chains.part_responses
    firsts, lasts = chains.firsts, chains.lasts
    most = math.pi / responses[0].h
    if h != responses[0].h:
        responses = part_responses
        for k in range(len(states)):
            set_response(links[k], h, responses[k])
    for index in range(begin, end):
        set_bones(origin + (index + 1) * h, knots, rows, roots)
        for chain in range(len(starts)):
            start, stop = starts[chain], ends[chain]
            if firsts[chain] < lasts[chain]:
                advance_among(chains, states, chain, origin + index * h, h, knots, rows)
                continue
            link = links[start]
            frame = root_frame(link, roots[link.bone], matrix)
            forces = root_forces(link, responses[start], states[start], frame)
            substeps = substep_count(forces, responses[start])
            if substeps == 1:
                step_chain(links, responses, states, start, stop, frame, forces, most)
                continue
            for k in range(start, stop):
                set_response(links[k], h / substeps, part_responses[k])
            for part in range(1, substeps):
                bone = bone_at(origin + (index + part / substeps) * h, knots, rows, link.bone)
                part_step(links, part_responses, states, start, stop,
                          root_frame(link, bone, matrix), most)
            part_step(links, part_responses, states, start, stop, frame, most)
