"""Compiles what every simulation calls, so that no program has to do it at its first start."""
from __future__ import annotations

import argparse
import sys
import time

from ..push import Push
from ..scene_file import load_scene
from ..simulation import Simulation
from . import SWITCH, ready

SCENES = {'drop': 200, 'crowd': 10}
"""Ticks of each: through the air, onto the ground and along it."""

EXAMPLE = """examples:
  python -m ragdoll_ros.compiled
  NUMBA_CACHE_DIR=/var/cache/ragdoll python -m ragdoll_ros.compiled     keeps the result there;
                                           nodes that are to find it want the same variable,
                                           and must be able to write there, as numba asks for it
"""

NOT_READY = ("Nothing to compile with: pip install 'ragdoll_ros[fast]' gets numba, and all works "
             f'without. (Or {SWITCH}=0 is set.)')


def main(arguments: list[str] | None = None) -> int:
    """Run the command; the exit code: 2 if nothing can be compiled."""
    argparse.ArgumentParser(
        'python -m ragdoll_ros.compiled', description=__doc__, epilog=EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter).parse_args(arguments)
    if not ready():
        print(NOT_READY, file=sys.stderr)
        return 2
    began = time.monotonic()
    from . import cache, loaded  # noqa: F401
    with cache.alone():
        for name, ticks in SCENES.items():
            _run(name, ticks)
    kept = f'kept in {cache.FOLDER}' if cache.KEPT else 'kept nowhere'
    print(f'The dynamics are compiled: {time.monotonic() - began:.1f} s, {kept}')
    return 0


def _run(name: str, ticks: int) -> None:
    """Fly, be pushed, be held and fall."""
    scene = load_scene(name)
    with Simulation(scene) as simulation:
        simulation.push(Push(scene.bone_names[0], (100.0, 0.0, 0.0)))
        simulation.grab('hand', scene.bone_names[-1])
        simulation.advance()
        simulation.let_go('hand')
        for _ in range(ticks):
            simulation.advance()


if __name__ == '__main__':
    sys.exit(main())
