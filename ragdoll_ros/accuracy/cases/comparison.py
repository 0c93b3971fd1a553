"""The contact parameters at which engines are compared. Every engine represents them, but Drake has
no restitution.
"""
import dataclasses
from dataclasses import dataclass

from ...files.scene import load_scene
from ...model.scene import Scene
from .trial import Trial

FRICTION = 0.7
"""Of all bodies in comparisons. PyBullet and MuJoCo cannot represent the unlimited friction of the
default scene; see model/scene.py."""

RESTITUTIONS = (0.5, 0.0)
"""Compared: that of the default scene, and none, which every engine can represent."""


@dataclass(frozen=True)
class Law:
    """Contact parameters of a comparison."""

    restitution: float = RESTITUTIONS[0]
    friction: float = FRICTION


LAWS = (*map(Law, RESTITUTIONS), Law(0.0, 0.0))
"""Under the last one, without restitution and friction, all engines have the same law."""


def drop_scene(restitution: float = RESTITUTIONS[0], friction: float = FRICTION) -> Scene:
    """The default scene with the contact parameters of a comparison."""
    return with_law(load_scene('drop'), restitution, friction)


def compared(trial: Trial, restitution: float = RESTITUTIONS[0]) -> Trial:
    """The same trial with the friction of comparisons and a restitution."""
    return dataclasses.replace(trial, scene=with_law(trial.scene, restitution))


def with_law(scene: Scene, restitution: float, friction: float = FRICTION) -> Scene:
    """The same scene with a restitution and a friction."""
    return dataclasses.replace(scene, material=dataclasses.replace(
        scene.material, friction=friction, restitution=restitution))
