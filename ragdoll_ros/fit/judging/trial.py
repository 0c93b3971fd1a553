"""A short fall of the doll, alone above level ground."""
from __future__ import annotations

import math

from ...model import errors
from ...model.ragdoll import Ragdoll
from ...model.scene import above_ground
from .finding import Finding

DURATION = 1.0
"""s."""

CLEARANCE = 0.2
"""How high it hangs, of its size."""

ENERGY, GAP, SINKING = 0.01, 0.001, 0.02
"""Energy from nothing, of what lifts the doll by its size; how far a joint may open and how deep a
body may sink in, of its size."""

OVERSHOOT = math.radians(3)
"""How far past its limits a joint may be."""


def find_in_a_fall(doll: Ragdoll, size: float) -> list[Finding]:
    """What goes wrong in a second of falling, by the engine that the doll will run on."""
    # Here, as who only fits a character needs no engine.
    from ...physics.simulation import Simulation
    scene = above_ground(doll, clearance=CLEARANCE * size)
    try:
        with Simulation(scene) as simulation:
            start, past = simulation.state.positions, simulation.measures()['limit_overshoot_rad']
            rise = 0.0
            for _ in range(round(DURATION / scene.step)):
                rise = max(rise, float((simulation.advance().positions - start)[:, 2].max()))
            measures = simulation.measures()
    except errors.RagdollError as error:
        return [Finding(f'it does not run: {error}', True)]
    found = []
    if measures['energy_excess_J'] > ENERGY * doll.mass * 9.8 * size:
        found.append(Finding('it gains energy from nothing as it falls', True))
    if measures['joint_gap_m'] > GAP * size:
        found.append(Finding(f'its joints open by {measures["joint_gap_m"]:.2g} m as it falls',
                             True))
    overshoot = max(past, measures['limit_overshoot_rad'])
    if overshoot > OVERSHOOT:
        found.append(Finding(f'a joint is {math.degrees(overshoot):.0f} degrees past its limits',
                             True))
    if measures['sinking_m'] > SINKING * size:
        found.append(Finding(f'it sinks {measures["sinking_m"]:.2g} m into the ground'))
    if not rise < size:
        found.append(Finding(f'its fall throws a body up by {rise:.2g} m', True))
    return found
