"""What can be compiled or done by numpy, made here the one way or the other."""
from __future__ import annotations

from ..model.coordinates import DofLayout
from ..model.scene import Scene
from .engine.protocol import Engine
from .flight import Dynamics
from .kernels import ready
from .plain.conservation import ConservationProjection
from .plain.flight import EngineDynamics
from .plain.limits import JointLimits
from .plain.mechanics import Mechanics
from .plain.reach import Reach


def dynamics_of(scene: Scene, make_engine: type[Engine], layout: DofLayout) -> Dynamics:
    """The equations of motion of a scene in the air."""
    if ready():
        from .dynamics import CompiledDynamics
        return CompiledDynamics(scene)
    return EngineDynamics(scene, make_engine, layout)


def mechanics_of(scene: Scene) -> Mechanics:
    """Sums over the bones of each doll."""
    if ready():
        from .conservation import CompiledMechanics
        return CompiledMechanics(scene)
    return Mechanics(scene)


def conservation_of(scene: Scene, mechanics: Mechanics,
                    layout: DofLayout) -> ConservationProjection:
    """Who keeps energy and momentum."""
    if ready():
        from .conservation import CompiledProjection
        return CompiledProjection(scene, mechanics, layout)
    return ConservationProjection(scene, mechanics, layout)


def limits_of(layout: DofLayout) -> JointLimits:
    """What joint limits have to say."""
    if ready():
        from .limits import CompiledLimits
        return CompiledLimits(layout)
    return JointLimits(layout)


def reach_of(scene: Scene) -> Reach:
    """What bones can reach."""
    if ready():
        from .reach import CompiledReach
        return CompiledReach(scene)
    return Reach(scene)
