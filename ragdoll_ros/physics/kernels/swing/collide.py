"""A chain among colliders over an interval of the grid, divided where a tip arrives at one."""
from __future__ import annotations

import collections
import math

import numpy as np

from ..compiling.decorators import compiled
from ..maths.vectors import add_scaled, norm, put, vec
from .bone_path import set_bones
from .colliders import FREE, TOUCH, copy_state, step_touching, tip_contact
from .link_step import limited, root_forces, root_frame, set_response, tip_frame
from .links import Around, Chains

Path = collections.namedtuple('Path', 'origin knots rows')
"""The path of bones from the instant ``origin`` s on; see set_bones()."""

MAX_ARRIVALS = 16
"""In an interval; after them all colliders hold a tip without a search for its arrival."""

SEARCHES = 40
"""Most steps to find an arrival: more than bisection of an interval to rounding takes."""

LARGEST_MOVE = 0.5
"""Of the least radius: a tip's way in a step, so that it does not pass through."""

MAX_PARTS = 64
"""Of an interval, without arrivals."""


@compiled
def longest_step(chains: Chains, states: np.ndarray, chain: int) -> float:
    """Time, s, in which no tip of a chain moves farther, at the present speeds, than LARGEST_MOVE
    times the least radius of its colliders.
    """
    radius, speed = FREE, 0.0
    for k in range(chains.firsts[chain], chains.lasts[chain]):
        radius = min(radius, chains.colliders[k].radius)
    for k in range(chains.starts[chain], chains.ends[chain]):
        tip = add_scaled(vec(states[k].velocity), chains.links[k].length, vec(states[k].rate))
        speed = max(speed, norm(tip))
    return LARGEST_MOVE * radius / (speed + 1e-300)


@compiled
def try_step(chains: Chains, states: np.ndarray, chain: int, h: float, bones_before: np.ndarray,
             bones: np.ndarray, holds_all: bool) -> float:
    """Step a chain from chains.before by ``h`` s; ``bones_before``, ``bones`` (b, 13): states at
    its start and end. Returns the least gap, m, see step_touching(); also for ``holds_all``.
    """
    links, responses, before = chains.links, chains.part_responses, chains.before
    start, stop = chains.starts[chain], chains.ends[chain]
    around = Around(chains.colliders, chains.firsts[chain], chains.lasts[chain], bones_before,
                    bones, holds_all)
    most = math.pi / chains.responses[0].h
    matrix = np.empty((3, 3))
    frame = root_frame(links[start], bones[links[start].bone], matrix)
    least = FREE
    for k in range(start, stop):
        if k > start:
            frame = tip_frame(links[k - 1], states[k - 1], most)
        set_response(links[k], h, responses[k])
        copy_state(before[k], states[k])
        forces = root_forces(links[k], responses[k], states[k], frame)
        gap = step_touching(links[k], responses[k], before[k], states[k], frame, forces,
                            around)
        if k > start:
            put(states[k].rate, limited(vec(states[k].rate), most))
        least = min(least, gap)
    return least


@compiled
def least_gap_before(chains: Chains, chain: int, bones: np.ndarray) -> float:
    """Least gap, m, of those above TOUCH between the tips and colliders of a chain, at the link
    states chains.before and the bone states ``bones`` (b, 13) of the same time; FREE if none.
    """
    least = FREE
    for k in range(chains.starts[chain], chains.ends[chain]):
        for number in range(chains.firsts[chain], chains.lasts[chain]):
            collider = chains.colliders[number]
            gap = tip_contact(chains.links[k], chains.before[k], collider, bones[collider.bone])[0]
            if gap > TOUCH:
                least = min(least, gap)
    return least


@compiled
def step_to_arrival(chains: Chains, states: np.ndarray, chain: int, high: float, high_gap: float,
                    bones_before: np.ndarray, bones: np.ndarray, path: Path) -> float:
    """Step a chain from chains.before, at path.origin, to the first instant before ``high``, s, at
    which a tip touches a collider that it did not touch; at ``high`` the gap is ``high_gap``, m.
    Uses regula falsi with the factors of Illinois, later bisection. Returns the time from
    path.origin, s; ``bones`` are then those of that instant.
    """
    low, low_gap, span = 0.0, least_gap_before(chains, chain, bones_before), high
    side = 0
    for search in range(SEARCHES):
        share = low_gap / (low_gap - high_gap)
        # Where gaps of several tips change places, bisection goes on.
        span = low + (high - low) * (share if search < SEARCHES // 2 else 0.5)
        set_bones(path.origin + span, path.knots, path.rows, bones)
        gap = try_step(chains, states, chain, span, bones_before, bones, False)
        if abs(gap) <= TOUCH:
            break
        if gap > 0:
            low, low_gap = span, gap
            high_gap *= 0.5 if side > 0 else 1.0
            side = 1
        else:
            high, high_gap = span, gap
            low_gap *= 0.5 if side < 0 else 1.0
            side = -1
    return span


@compiled
def advance_among(chains: Chains, states: np.ndarray, chain: int, origin: float, h: float,
                  knots: np.ndarray, rows: np.ndarray) -> None:
    """Integrate a chain among its colliders from ``origin`` s over ``h`` s; scratch: ``before``."""
    start, stop = chains.starts[chain], chains.ends[chain]
    bones_before, bones = np.empty_like(chains.roots), np.empty_like(chains.roots)
    set_bones(origin, knots, rows, bones_before)
    done, arrivals = 0.0, 0
    while done < h:
        for k in range(start, stop):
            copy_state(states[k], chains.before[k])
        span = min(h - done, max(longest_step(chains, states, chain), h / MAX_PARTS))
        set_bones(origin + done + span, knots, rows, bones)
        gap = try_step(chains, states, chain, span, bones_before, bones,
                       arrivals >= MAX_ARRIVALS)
        if gap < -TOUCH and arrivals < MAX_ARRIVALS:
            span = step_to_arrival(chains, states, chain, span, gap, bones_before, bones,
                                   Path(origin + done, knots, rows))
            arrivals += 1
        done = h if span == h - done else done + span
        bones_before[:] = bones
