"""A small fall detector, trained on simulated falls: an example, not a product.

python docs/falls_detector.py [--falls 40]

A sensor at the low back, 100 Hz. Falls are those of config/recipes/faint.yaml and shove.yaml; what
is no fall is the same people lowered by two hands, at chest and pelvis, to sit or to lie. A random
forest classifies windows of 0.5 s. Needs scikit-learn.
"""
from __future__ import annotations

import argparse

import numpy as np
from sklearn.ensemble import RandomForestClassifier

from ragdoll_ros.falls import Fall, Phases, Recipe, generate, load_recipe
from ragdoll_ros.falls.fall import fall_samples
from ragdoll_ros.falls.recipe import recipe_of
from ragdoll_ros.falls.simulate import begin
from ragdoll_ros.falls.start import start_of
from ragdoll_ros.physics.simulation import Simulation

WINDOW, STRIDE, AFTER = 50, 10, 30
"""Frames of a window, between windows, and after an impact within which to detect a fall."""


def worn(name: str, seed: int, **changes: object) -> Recipe:
    """A recipe of config/recipes/, limited to 2 s; each seed gives other falls."""
    return recipe_of({**load_recipe(name).data, 'seed': seed, 'duration': 2.0, **changes})


def let_down(recipe: Recipe, number: int) -> Fall:
    """The start of a fall, but two hands hold chest and pelvis and lower them in 0.8 to 1.5 s.

    Even numbers sit: the chest stays up. Odd ones lie: it is laid backwards. The hands move
    with minimum jerk (Flash and Hogan, J Neurosci 1985).
    """
    start = start_of(recipe, number)
    rng = np.random.default_rng([recipe.data['seed'], number])
    begins, takes = rng.uniform(0.2, 0.5), rng.uniform(0.8, 1.5)
    rows = []
    with Simulation(start.scene, accuracy='draft', engine='rigid') as simulation:
        begin(simulation, start)
        poses = {bone: simulation.state.poses(start.scene.bone_index(bone))
                 for bone in ('chest', 'pelvis')}
        length = np.linalg.norm(poses['chest'].position - poses['pelvis'].position)
        held = {bone: pose.position for bone, pose in poses.items()}
        seat = np.array([*held['pelvis'][:2], 0.2])
        back = poses['pelvis'].apply(np.array([-length, 0, 0])) - held['pelvis']
        goals = {'pelvis': seat,
                 'chest': seat + ((0, 0, length) if number % 2 == 0 else back * (1, 1, 0))}
        for bone in goals:
            simulation.grab(bone, bone)
        for frame in range(recipe.frames):
            rows.append(simulation.state.rows)
            share = np.clip((frame / recipe.rate - begins) / takes, 0, 1)
            smooth = share ** 3 * (10 - 15 * share + 6 * share ** 2)
            for hand, place in goals.items():
                simulation.drag(hand, held[hand] + smooth * (place - held[hand]), 1 / recipe.rate)
            simulation.advance()
    states = np.array(rows)
    n = states.shape[1]
    return Fall(number, start.drawn, start.scene, np.arange(len(rows)) / recipe.rate, states,
                np.zeros((len(rows), 0)), np.zeros((len(rows), 0)), np.zeros((len(rows), n), bool),
                recipe.imus, 1, states[:, [start.scene.bone_index(recipe.imus[0]['bone'])]],
                len(rows), '', Phases(), 0.0)


def windows(fall: Fall) -> tuple[np.ndarray, np.ndarray]:
    """Features (w, 12) of all windows, and the frames (w,) after their last ones."""
    samples = fall_samples(fall, 0)
    sizes = np.stack([np.linalg.norm(samples[:, :3], axis=1),
                      np.linalg.norm(samples[:, 3:], axis=1), samples[:, 2]], axis=1)
    ends = np.arange(WINDOW, len(sizes) + 1, STRIDE)
    views = np.stack([sizes[end - WINDOW:end] for end in ends])
    return np.concatenate([views.min(axis=1), views.max(axis=1), views.mean(axis=1),
                           views.std(axis=1)], axis=1), ends


def told(fall: Fall, ends: np.ndarray) -> np.ndarray:
    """Windows (w,) that end within AFTER frames of the impact."""
    impact = fall.phases.impact
    return np.zeros(len(ends), bool) if impact is None else (ends > impact) & (
        ends <= impact + AFTER)


def train(falls: list[Fall], others: list[Fall]) -> RandomForestClassifier:
    """Train on windows of falls after their impacts, and on windows of no fall."""
    features, labels = [], []
    for fall in [*falls, *others]:
        rows, ends = windows(fall)
        used = told(fall, ends) if fall.phases.impact is not None else np.ones(len(ends), bool)
        features.append(rows[used])
        labels += [fall.phases.impact is not None] * int(used.sum())
    forest = RandomForestClassifier(100, random_state=0, class_weight='balanced')
    return forest.fit(np.concatenate(features), labels)


def says(forest: RandomForestClassifier, fall: Fall) -> bool:
    """Whether a window is classified as a fall: for falls, one that ends after the impact."""
    rows, ends = windows(fall)
    used = told(fall, ends) if fall.phases.impact is not None else np.ones(len(ends), bool)
    return bool(used.any()) and bool(forest.predict(rows[used]).any())


def jolts(fall: Fall, limit: float = 3 * 9.8) -> bool:
    """The plain rule: more than 3 g."""
    return bool((np.linalg.norm(fall_samples(fall, 0)[:, :3], axis=1) > limit).any())


def main() -> None:
    """Train with one seed, test with another, print the scores."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--falls', type=int, default=40, help='of each kind and each seed')
    count = parser.parse_args().falls
    sets = {seed: [list(generate(worn(name, seed), range(count))) for name in ('faint', 'shove')]
            + [[let_down(worn('faint', seed, limp=[]), number) for number in range(count)]]
            for seed in (0, 1)}
    forest = train(sets[0][0] + sets[0][1], sets[0][2])
    print('| | told as falls by the forest | by more than 3 g |')
    print('| --- | --- | --- |')
    sitting, lying = sets[1][2][::2], sets[1][2][1::2]
    for name, falls in (('faint', sets[1][0]), ('shove', sets[1][1]), ('sitting down', sitting),
                        ('lying down', lying)):
        shares = [np.mean([judge(fall) for fall in falls])
                  for judge in (lambda fall: says(forest, fall), jolts)]
        print(f'| {name}, {len(falls)} | {shares[0]:.1%} | {shares[1]:.1%} |')


if __name__ == '__main__':
    main()
