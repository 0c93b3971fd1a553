"""Robots that come with PyBullet: each fits with the mass that PyBullet knows, or says why not."""
from pathlib import Path

import pytest

from ragdoll_ros.fit.robots.robot import read_urdf
from ragdoll_ros.model import errors

data = pytest.importorskip('pybullet_data')
pybullet = pytest.importorskip('pybullet')

FOLDER = Path(data.getDataPath())

FEW = ('a1/a1.urdf', 'bicycle/bike.urdf', 'humanoid/humanoid.urdf', 'kuka_iiwa/model.urdf',
       'r2d2.urdf', 'franka_panda/panda.urdf', 'teddy_vhacd.urdf', 'random_urdfs/472/472.urdf')

REFUSED = {'biped/biped2d_pybullet.urdf': "'-1.57.'",
           'husky/husky.urdf': 'expand a xacro first',
           'plane_implicit.urdf': 'a <plane> is ignored',
           'quadruped/microtaur/microtaur.urdf': 'expected 3 finite numbers',
           'racecar/racecar_differential.urdf': "'1 1 1 1'",
           'torus_deform.urdf': 'at least one link',
           'toys/concave_box.urdf': 'a <cdf> is ignored'}
"""What is refused, and what the sentence says of it."""


def mass_in_pybullet(path):
    """Sum of the links' masses, kg; None where PyBullet cannot load the file."""
    client = pybullet.connect(pybullet.DIRECT)
    try:
        body = pybullet.loadURDF(str(path), flags=pybullet.URDF_USE_INERTIA_FROM_FILE,
                                 physicsClientId=client)
        return sum(pybullet.getDynamicsInfo(body, link, physicsClientId=client)[0]
                   for link in range(-1, pybullet.getNumJoints(body, physicsClientId=client)))
    except pybullet.error:
        return None
    finally:
        pybullet.disconnect(client)


def check(name):
    path = FOLDER / name
    if name in REFUSED:
        with pytest.raises(errors.ModelErrors) as caught:
            read_urdf(path)
        assert REFUSED[name] in str(caught.value)
        return
    doll, notes = read_urdf(path)
    # PyBullet gives 1 kg to a link that says nothing of its mass, and none to what has none.
    text = path.read_text(errors='replace')
    if text.count('<link ') == text.count('<mass ') and 'has no mass' not in str(notes):
        mass = mass_in_pybullet(path)
        assert mass is None or doll.mass == pytest.approx(mass, rel=1e-6), name


@pytest.mark.parametrize('name', [*FEW, *REFUSED])
def test_a_robot_of_pybullets_fits_or_says_why_not(name):
    check(name)


@pytest.mark.slow
def test_all_of_pybullets_robots():
    for path in sorted(FOLDER.rglob('*.urdf')):
        if path.parent.parent.name != 'random_urdfs' or path.stem.endswith('7'):
            check(path.relative_to(FOLDER).as_posix())
