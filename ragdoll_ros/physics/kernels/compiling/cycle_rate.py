"""How many cycles, as cycles() counts them, a second has."""
import time

from .cycles import COUNTED, cycles
from .decorators import entry


@entry()
def cycles_now() -> int:
    """Cycles of the processor by cycles(), for Python; 0 where they are not counted."""
    return cycles()


def cycle_rate(seconds: float = 0.05) -> float:
    """Measure the cycles per second of cycles() by busy waiting for ``seconds`` s; 0 where cycles
    are not counted.
    """
    if not COUNTED:
        return 0.0
    start, first = time.perf_counter(), cycles_now()
    while time.perf_counter() < start + seconds:
        pass
    return (cycles_now() - first) / (time.perf_counter() - start)
