"""Drop test: a short fall of the doll alone onto level ground."""
import math

from ...model import errors
from ...model.ragdoll import Ragdoll
from ...model.scene import above_ground
from .finding import Finding

DURATION = 1.0
"""s."""

CLEARANCE = 0.2
"""Initial height above the ground, as a fraction of the doll's size."""

MAX_ENERGY, MAX_JOINT_GAP, MAX_PENETRATION = 0.01, 0.001, 0.02
"""Energy gain as a fraction of m g times the size; joint gap and penetration of the ground as
fractions of the size."""

MAX_OVERSHOOT = math.radians(3)
"""Rotation beyond a joint limit."""


def run_drop_test(doll: Ragdoll, size: float) -> list[Finding]:
    """Faults in one second of simulation, with the default engine; ``size`` is the doll's, m."""
    # Imported here: fitting alone needs no engine.
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
        return [Finding(f'the simulation fails: {error}', True)]
    found = []
    if measures['energy_excess_J'] > MAX_ENERGY * doll.mass * 9.8 * size:
        found.append(Finding('it gains energy in the drop test', True))
    if measures['joint_gap_m'] > MAX_JOINT_GAP * size:
        found.append(Finding(f'its joints open by {measures["joint_gap_m"]:.2g} m in the drop test',
                             True))
    overshoot = max(past, measures['limit_overshoot_rad'])
    if overshoot > MAX_OVERSHOOT:
        found.append(Finding(f'a joint is {math.degrees(overshoot):.0f} degrees past its limits',
                             True))
    if measures['sinking_m'] > MAX_PENETRATION * size:
        found.append(Finding(f'it penetrates the ground by {measures["sinking_m"]:.2g} m'))
    if not rise < size:
        found.append(Finding(f'the drop test throws a body up by {rise:.2g} m', True))
    return found
