"""`python -m ragdoll_ros.accuracy.ledger SCENE`: what a tick of engine rigid is made of.

Per tick: steps by what became of them, contact solves and their sizes, and the time of each stage.
Times depend on the machine: compare their shares.
"""
from __future__ import annotations

import argparse
import dataclasses
import math
import sys
import time

from ..files.scene import load_scene
from ..model import errors
from ..physics.accuracy import ACCURACIES
from ..physics.kernels import problem
from ..physics.simulation import Simulation

SCENES = ('drop', 'woman_faints', 'ponytail', 'crowd')

REJECTED = {'past_impact': 'past a time of impact', 'closed_unseen': 'a gap that closed too far',
            'new_contacts': 'new contacts within the step', 'too_deep': 'penetration',
            'too_coarse': 'error of a longer step, or a contact that began in it',
            'too_much_energy': 'energy gain'}
"""Counts of rejected trials, and why."""

STAGES = {'flight_cycles': 'flight', 'gaps_cycles': 'gaps before a step',
          'begin_cycles': 'begin a step: kinematics, sums, contacts',
          'dynamics_cycles': 'motion without contacts', 'find_cycles': 'find contacts',
          'solve_cycles': 'solve contacts', 'finish_cycles': 'end a step: position, gaps, sums',
          'impact_cycles': 'impacts'}
"""Cycles of the stages, and what these are."""

EXAMPLE = """examples:
  python -m ragdoll_ros.accuracy.ledger                     the scenes of make bench
  python -m ragdoll_ros.accuracy.ledger drop --accuracy exact
  python -m ragdoll_ros.accuracy.ledger my.yaml --seconds 10
"""


@dataclasses.dataclass(frozen=True)
class Ledger:
    """Counts of ``ticks`` ticks of a scene, and their wall time, ``seconds``."""

    ticks: int
    seconds: float
    counts: dict[str, int]
    rate: float
    """Cycles a second; 0: not counted."""

    @property
    def stages(self) -> dict[str, float]:
        """Time of each stage, s; the last two are other machine code, and Python."""
        found = {text: self.counts[name] / self.rate for name, text in STAGES.items()}
        machine = self.counts['all_cycles'] / self.rate
        return {**found, 'other machine code': machine - sum(found.values()),
                'Python': self.seconds - machine}


def measure(source: str, accuracy: str, seconds: float) -> Ledger:
    """Simulate ``seconds`` s of a scene from its start, without sleep, on one thread."""
    from ..physics.kernels.compiling.cycle_rate import cycle_rate
    awake = dataclasses.replace(ACCURACIES[accuracy], sleep=False)
    with Simulation(load_scene(source), engine='rigid', accuracy=awake) as simulation:
        for _ in range(3):
            simulation.advance()
        simulation.reset()
        before = simulation.ledger()
        ticks = math.ceil(seconds / simulation.step)
        begun = time.perf_counter()
        for _ in range(ticks):
            simulation.advance()
        taken = time.perf_counter() - begun
        counts = {name: count - before[name] for name, count in simulation.ledger().items()}
    return Ledger(ticks, taken, counts, cycle_rate())


def report(ledger: Ledger) -> str:
    """The ledger as text, per tick."""
    counts, ticks = ledger.counts, ledger.ticks
    rejected = sum(counts[name] for name in REJECTED)
    solves = max(counts['solves'], 1)
    lines = [
        f'{counts["steps"] - rejected:8d} steps, {(counts["steps"] - rejected) / ticks:.2f} a tick;'
        f' {counts["flight_steps"]} of flight, {counts["impacts"]} impacts',
        f'{rejected:8d} rejected, {rejected / max(counts["trials"], 1):.0%} of all trials:',
        *(f'{counts[name]:12d} {text}' for name, text in REJECTED.items() if counts[name]),
        f'{counts["solves"]:8d} islands solved, of {counts["contacts"] / solves:.1f} contacts, '
        f'{counts["rows"] / solves:.1f} rows and {counts["dofs"] / solves:.0f} degrees of freedom: '
        f'{counts["sweeps"] / solves:.2f} sweeps, {counts["newton_steps"] / solves:.2f} Newton '
        'steps each',
        f'{counts["gap_updates"]:8d} updates of all gaps, {counts["narrow_phases"]} narrow-phase '
        'calls']
    if ledger.rate:
        whole = ledger.seconds
        lines += [f'{1e6 * whole / ticks:8.1f} us a tick:',
                  *(f'{1e6 * spent / ticks:12.1f} {spent / whole:4.0%}  {text}'
                    for text, spent in ledger.stages.items())]
    return '\n'.join(lines)


def main(arguments: list[str] | None = None) -> int:
    """Run the command; the exit code: 2 if a scene cannot be read or engine rigid cannot run."""
    parser = argparse.ArgumentParser(
        'python -m ragdoll_ros.accuracy.ledger', description=__doc__, epilog=EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('scenes', nargs='*', default=SCENES, metavar='SCENE',
                        help='name of a shipped scene, or a file')
    parser.add_argument('--accuracy', choices=list(ACCURACIES), default='draft')
    parser.add_argument('--seconds', type=float, default=2.5,
                        help='simulated time, s (default: 2.5)')
    options = parser.parse_args(arguments)
    if not 0 < options.seconds <= 1000:
        parser.error(f'--seconds {options.seconds}: expected a number above 0, up to 1000')
    if problem():
        print(f'The ledger is of engine rigid, and {problem()}', file=sys.stderr)
        return 2
    for source in options.scenes:
        try:
            found = measure(source, options.accuracy, options.seconds)
        except errors.RagdollError as error:
            print(error, file=sys.stderr)
            return 2
        print(f'{source}, {options.accuracy}, {found.ticks} ticks\n{report(found)}\n', flush=True)
    return 0


if __name__ == '__main__':
    sys.exit(main())
