"""A typed program that uses every public name: checked by mypy --strict, and run, in test_public.

Each `type: ignore` is an error that mypy must find, as an unused one is an error in turn.
"""
from __future__ import annotations

from pathlib import Path

import numpy as np

import ragdoll_ros
from ragdoll_ros import (
    Bone,
    Box,
    Capsule,
    Compound,
    Cylinder,
    Drive,
    Follow,
    Ground,
    HeightField,
    Hull,
    Joint,
    Mesh,
    Motors,
    Part,
    Placement,
    Plane,
    Push,
    Ragdoll,
    RagdollError,
    Recorder,
    Riders,
    Scene,
    Simulation,
    Sphere,
    State,
    StaticBody,
    head_injury_criterion,
    impacts_with_uncertainty,
    load_animations,
    load_doll,
    load_limits,
    load_scene,
    person,
    run_many,
    save_doll,
    save_recording,
    save_scene,
)


def pendulum() -> Ragdoll:
    """Two bones and a hinge."""
    weight = Compound((Part(Sphere(0.1)), Part(Box((0.1, 0.1, 0.1)), position=(0.0, 0.0, 0.0))))
    bones = (Bone('beam', Capsule(0.05, 0.4), 1.0, (0.0, 0.0, 0.0)),
             Bone('weight', weight, mass=2.0, position=(0.0, 0.0, -0.6)))
    hinge = Joint('beam', 'weight', 'hinge', (0.0, 0.0, -0.3), ((0.0, 1.0, 0.0),), ((-1.0, 1.0),))
    return Ragdoll('pendulum', bones, (hinge,))


def ends(scenes: list[Scene]) -> list[np.ndarray]:
    """Last states of several scenes after three ticks."""
    return [rows[-1] for rows in run_many(scenes, 3, accuracy='draft', threads=2)]


def uncertain(scene: Scene) -> list[float]:
    """Uncertain speeds of impacts, m/s."""
    found = impacts_with_uncertainty(scene, 0.02, load_limits(), accuracy='draft')
    return [hit.uncertainty.speed for hit in found.impacts]


def fall(scene: Scene, folder: Path) -> State:
    """Three ticks with a push and a drive, written to a file."""
    recorder, riders = Recorder(scene), Riders(scene)
    with Simulation(scene, accuracy='normal', engine='auto', workers=1) as simulation:
        simulation.push(Push(scene.bone_names[0], force=(100.0, 0.0, 0.0)))
        print(Follow(500.0, 50.0).is_exact, simulation.stale_bodies)
        print(Motors(frequency=4.0).of(scene.dolls[0].doll), simulation.powered)
        simulation.set_strength(0.5, [scene.angle_names[0]])
        simulation.push(Drive(scene.bone_names[0], velocity=(1.0, 0.0, 0.0)), channel='drive')
        simulation.grab('hand', scene.bone_names[0], (0.0, 0.0, 0.0))
        simulation.let_go('hand')
        simulation.record_impacts(load_limits())
        for _ in range(3):
            state: State = simulation.advance()
            recorder.take(simulation)
        blows: list[float] = [impact.ratio for impact in simulation.impacts]
        nanoseconds: int = simulation.time
        asleep: bool = simulation.asleep
        measures: dict[str, float] = simulation.measures()
    assert nanoseconds and not asleep and measures and not blows and not uncertain(scene)
    assert head_injury_criterion([1000.0, 1000.0], rate=1000.0, window=0.015) > 0
    names: tuple[str, ...] = riders.names
    positions: np.ndarray = riders.poses(state).position
    assert len(names) == len(positions)
    paths: list[Path] = save_recording(recorder.recording(), folder / 'fall.csv')
    assert paths == [folder / 'fall.csv']
    return state


def main(folder: Path) -> None:
    """Use every name."""
    save_doll(pendulum(), folder / 'pendulum.yaml')
    doll: Ragdoll = load_doll(str(folder / 'pendulum.yaml'))
    assert doll == pendulum()
    stand = Ragdoll('stand', (Bone('stand', Cylinder(0.2, 0.1), 5.0, (0.0, 0.0, 0.05)),))
    hill = StaticBody('hill', HeightField(np.array([[0.0, 0.1], [0.0, 0.2]]), (4.0, 4.0)),
                      (0.0, 9.0, 0.0))
    ramp = StaticBody('ramp', Mesh(np.array([[0, 0, 0], [1, 0, 0], [0, 1, 1]], float),
                                   np.array([[0, 1, 2]])), (0.0, -9.0, 0.0))
    stone = StaticBody('stone', Hull(np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], float),
                                     np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])),
                       (9.0, 0.0, 0.0))
    slope = StaticBody('slope', Plane(), (0.0, 0.0, -1.0), (0.0, 0.1, 0.0, 1.0))
    scene = Scene('pair', (Placement(doll, position=(0.0, 0.0, 2.0)), Placement(stand),
                           Placement(person(1.75, 70.0, 'female'), position=(1.0, 0.0, 0.0))),
                  Ground(), bodies=(StaticBody('wall', Box((0.1, 2.0, 2.0)), (2.0, 0.0, 1.0)),
                                    hill, ramp, stone, slope))
    save_scene(scene, folder / 'pair.yaml')
    state = fall(load_scene(str(folder / 'pair.yaml')), folder)
    character = load_doll('character')
    starts: list[Placement] = [animation.place(Placement(character), animation.duration)
                               for animation in load_animations(character).values()]
    assert not starts
    walker = load_doll('walker')
    walks: Placement = load_animations(walker)['walk'].play(Placement(walker), loop=True)
    with Simulation(Scene('walk', (walks,))) as simulation:
        animated: tuple[str, ...] = simulation.animated
        simulation.go_limp(animated[0])
    rows: tuple[int, ...] = state.positions.shape
    assert rows == (len(scene.bone_names), 3) and state.linear_velocities.shape == rows
    assert ends([scene, scene])[1].shape == (rows[0], 13)
    try:
        Push('torso', duration=-1.0)
    except RagdollError as error:
        assert 'duration' in str(error)


def wrong(state: State) -> None:
    """What mypy must refuse; never called."""
    ragdoll_ros.Nonsense  # type: ignore[attr-defined]  # noqa: B018
    state.nonsense  # type: ignore[attr-defined]  # noqa: B018
    Sphere('wide')  # type: ignore[arg-type]
    load_scene()  # type: ignore[call-arg]
