"""Shape against shape: distances as MuJoCo has them, patches as geometry has them."""
from __future__ import annotations

import copy
import itertools
import math

import numpy as np
import pytest
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

pytest.importorskip('numba')
from kept_code import kept

from ragdoll_ros import Box, Hull
from ragdoll_ros.physics.engine.rigid.hull_tables import hull_tables, join_hulls
from ragdoll_ros.physics.kernels.collision.narrow_phase import collide, separation
from ragdoll_ros.physics.kernels.collision.shapes import (
    BOX,
    CAPSULE,
    CYLINDER,
    HULL,
    SHAPE_KIND,
    SPHERE,
    Shape,
)
from ragdoll_ros.physics.kernels.compiling.bundle import bind
from ragdoll_ros.physics.kernels.system import CONTACT_POINT, MAX_MANIFOLD_POINTS, blank_system

KINDS = (SPHERE, CAPSULE, BOX, CYLINDER, HULL)
PAIRS = list(itertools.combinations_with_replacement(KINDS, 2))
NAMES = {kind: name for name, kind in SHAPE_KIND.items()}
TURNED, UPRIGHT = Rotation.from_rotvec([.3, -.5, .7]), Rotation.identity()


@kept
def _collide(a, b, margin, out):
    return collide(a, b, margin, out)


@kept
def _separation(a, b):
    return separation(a, b, math.inf)


@kept
def _way_to_gap(a, b, direction, wanted):
    """How far, m, below 2, body a goes in a direction until its gap is wanted: to the last bit."""
    near, far = 0.0, 2.0
    while True:
        way = (near + far) / 2
        if way in (near, far):
            return way
        x, y, z = a.position
        moved = Shape(a.kind, a.size, (x + way * direction[0], y + way * direction[1],
                                       z + way * direction[2]), a.rotation, a.edges,
                      a.system, a.hull)
        if separation(moved, b, math.inf) < wanted:
            near = way
        else:
            far = way


def hull_around(points):
    """The convex hull of points (p, 3), by Qhull."""
    found = ConvexHull(points)
    corners = found.points[found.simplices]
    inward = np.einsum('ti,ti->t', np.cross(*np.diff(corners, axis=1).swapaxes(0, 1)),
                       found.equations[:, :3]) < 0
    faces = np.where(inward[:, None], found.simplices[:, ::-1], found.simplices)
    return Hull(found.points, faces)


def some_hulls():
    """Stones of 4 to 30 points, and a prism of 11 sides."""
    rng = np.random.default_rng(36)
    stones = [rng.normal(size=(count, 3)) for count in (4, 6, 9, 14, 20, 30)]
    ring = 2 * math.pi * np.arange(11) / 11
    prism = [(0.8 * math.cos(a), 0.8 * math.sin(a), z) for a in ring for z in (-0.6, 0.6)]
    return [hull_around(points) for points in (
        *(0.2 * stone / np.linalg.norm(stone, axis=1)[:, None] * rng.uniform(.5, 1, 3)
          for stone in stones), 0.2 * np.array(prism))]


HULLS = some_hulls()
TABLES = join_hulls([hull_tables(hull) for hull in HULLS])
SYSTEM = blank_system()._replace(**TABLES._asdict())
ROWS = bind(SYSTEM)


class Body:
    def __init__(self, kind, size, centre=(0, 0, 0), turn=None):
        self.kind, self.size = kind, np.array([*size, 0, 0][:3], float)
        self.hull = int(size[1]) if kind == HULL else 0
        """Of a hull, whose size is its radius and its number."""
        self.centre = np.array(centre, float)
        self.turn = turn or UPRIGHT

    @property
    def turn(self):
        return self._turn

    @turn.setter
    def turn(self, turn):
        # SciPy takes as long for a matrix as the kernels for a gap.
        self._turn, self._matrix = turn, np.ascontiguousarray(turn.as_matrix())

    @property
    def shape(self):
        size = (self.size[0], 0.0, 0.0) if self.kind == HULL else tuple(self.size)
        return Shape(self.kind, size, tuple(map(float, self.centre)), self._matrix,
                     (0.0, 0.0, 0.0), int(ROWS[0].ctypes.data), self.hull)

    def moved(self, way, spin=None):
        if spin is not None:
            return Body(self.kind, self.size, self.centre + way,
                        Rotation.from_rotvec(spin) * self.turn)
        body = copy.copy(self)
        body.centre = self.centre + way
        return body

    def seen(self, turn, way):
        return Body(self.kind, self.size, turn.apply(self.centre) + way, turn * self.turn)

    def velocity(self, velocity, spin, place):
        return velocity + np.cross(spin, place - self.centre)


def gap(a, b):
    return _separation(a.shape, b.shape)


def contacts(a, b, margin=1e-3):
    out = np.zeros(MAX_MANIFOLD_POINTS, CONTACT_POINT)
    out['point'] = out['normal'] = out['gap'] = np.nan
    out['feature_id'] = -1
    found = out[:_collide(a.shape, b.shape, float(margin), out)]
    assert all(np.isfinite(found[name]).all() for name in ('point', 'normal', 'gap'))
    assert (np.abs(np.linalg.norm(found['normal'], axis=1) - 1) <= 1e-12).all()
    assert len(set(found['feature_id'])) == len(found) and (found['feature_id'] >= 0).all()
    return found


def any_body(rng, kind, place=0.0):
    if kind == HULL:
        return a_hull(int(rng.integers(len(HULLS))), rng.normal(size=3) * place,
                      Rotation.random(random_state=rng))
    size = rng.uniform(.05, .3, {SPHERE: 1, BOX: 3}.get(kind, 2))
    return Body(kind, size, rng.normal(size=3) * place, Rotation.random(random_state=rng))


def a_hull(number, centre, turn):
    return Body(HULL, (TABLES.hulls['size'][number], number), centre, turn)


def touching(rng, kind_a, kind_b, wanted=0.0):
    """Two bodies in random poses whose gap is ``wanted``; their middles are not on one line."""
    a, b = any_body(rng, kind_a, .03), any_body(rng, kind_b)
    way = rng.normal(size=3)
    way /= np.linalg.norm(way)
    assert gap(a, b) < wanted < gap(a.moved(2 * way), b)
    return a.moved(way * _way_to_gap(a.shape, b.shape, way, wanted)), b


def places(found):
    """Points in an order of their own."""
    rows = np.round(found['point'], 7) + 0.0
    return found[np.lexsort(rows.T)]['point']


class Peer:
    """MuJoCo's distance of two shapes."""

    def __init__(self, kind_a, kind_b):
        self.mujoco = pytest.importorskip('mujoco')
        body = '<body><freejoint/><geom type="{}" size=".1 .1 .1"/></body>'
        mesh = '<mesh name="{}" vertex="{}"/>'
        hull = '<body><freejoint/>' + ''.join(
            f'<geom type="mesh" mesh="{number}"/>' for number in range(len(HULLS))) + '</body>'
        self.model = self.mujoco.MjModel.from_xml_string(
            '<mujoco><option ccd_tolerance="1e-12" ccd_iterations="500"/><asset>'
            + ''.join(mesh.format(number, ' '.join(map(str, (
                each.vertices - each.centroid).ravel()))) for number, each in enumerate(HULLS))
            + '</asset><worldbody>' + ''.join(
                hull if kind == HULL else body.format(NAMES[kind]) for kind in (kind_a, kind_b))
            + '</worldbody></mujoco>')
        self.data = self.mujoco.MjData(self.model)

    def distance(self, a, b):
        geoms = []
        for i, body in enumerate((a, b)):
            geoms.append(int(self.model.body_geomadr[1 + i]) + body.hull)
            if body.kind != HULL:
                self.model.geom_size[geoms[i]] = body.size
            self.data.qpos[7 * i:7 * i + 3] = body.centre
            self.data.qpos[7 * i + 3:7 * i + 7] = body.turn.as_quat()[[3, 0, 1, 2]]
        self.mujoco.mj_kinematics(self.model, self.data)
        return self.mujoco.mj_geomDistance(self.model, self.data, *geoms, 10.0, None)


@pytest.mark.parametrize('pair', PAIRS)
def test_apart_it_is_the_distance(pair):
    # MuJoCo's own search ends within some 1e-10 m with cylinders, at rounding else; the vertices of
    # its meshes are of single precision
    rng, peer = np.random.default_rng(1), Peer(*pair)
    for _ in range(400):
        a, b = any_body(rng, pair[0], .3), any_body(rng, pair[1], .3)
        due, found = peer.distance(a, b), gap(a, b)
        if pair == (BOX, BOX):
            assert (due > 0) == (found > 0) and found <= due + 1e-12
        elif found > 0:
            assert abs(found - due) <= (2e-6 if pair == (CYLINDER, CYLINDER)
                                        else 5e-8 if HULL in pair else 1e-9)


@pytest.mark.parametrize('pair', PAIRS)
def test_at_touch_it_is_the_peers_signed_distance(pair):
    rng, peer = np.random.default_rng(2), Peer(*pair)
    for _ in range(200):
        a, b = touching(rng, *pair, rng.uniform(-1e-4, 1e-4))
        assert gap(a, b) == pytest.approx(peer.distance(a, b), abs=5e-8 if HULL in pair else 2e-9)


@pytest.mark.parametrize('pair', PAIRS)
def test_the_deepest_contact_is_as_deep_as_the_bodies(pair):
    # but in where an axis of a face or its contact is taken instead of one better by 2 %
    rng = np.random.default_rng(3)
    off = []
    for _ in range(300):
        a, b = touching(rng, *pair, rng.uniform(-1e-4, 1e-4))
        off.append(abs(contacts(a, b)['gap'].min() - gap(a, b)))
    assert np.quantile(off, .98) < 1e-9 and max(off) < 4.3e-6


@pytest.mark.parametrize('pair', PAIRS)
def test_swapped_bodies_have_the_same_contacts(pair):
    rng = np.random.default_rng(4)
    for _ in range(100):
        a, b = touching(rng, *pair, -1e-5)
        one, other = contacts(a, b), contacts(b, a)
        assert gap(a, b) == pytest.approx(gap(b, a), abs=1e-9)
        deep, same = one[one['gap'].argmin()], other[other['gap'].argmin()]
        # a contact is found along a curved rim within some 1e-6 of its radius
        assert same['point'] == pytest.approx(deep['point'], abs=1e-5)
        assert same['normal'] == pytest.approx(-deep['normal'], abs=2e-5)


@pytest.mark.parametrize('pair', PAIRS)
def test_where_the_bodies_are_seen_from_changes_nothing(pair):
    rng, way = np.random.default_rng(5), np.array([3, -2, 1.5])
    for _ in range(100):
        a, b = touching(rng, *pair, -1e-5)
        c, d = a.seen(TURNED, way), b.seen(TURNED, way)
        assert gap(c, d) == pytest.approx(gap(a, b), abs=1e-9)
        one, other = contacts(a, b), contacts(c, d)
        one, other = one[one['gap'].argmin()], other[other['gap'].argmin()]
        assert other['point'] == pytest.approx(TURNED.apply(one['point']) + way, abs=1e-5)
        assert other['normal'] == pytest.approx(TURNED.apply(one['normal']), abs=2e-5)


@pytest.mark.parametrize('pair', PAIRS)
def test_the_gap_changes_by_the_velocity_along_the_normal(pair):
    rng, h = np.random.default_rng(6), 1e-6
    off = []
    for _ in range(150):
        a, b = touching(rng, *pair, rng.uniform(-1e-5, 1e-5))
        v, w = rng.normal(size=3), rng.normal(size=3)
        rate = (gap(a.moved(v * h, w * h), b) - gap(a.moved(-v * h, -w * h), b)) / (2 * h)
        found = contacts(a, b)
        deep = found[found['gap'].argmin()]
        off.append(abs(rate - a.velocity(v, w, deep['point']) @ deep['normal']))
    # where another feature is about to take over within 1e-6 s the rate has a corner
    assert np.quantile(off, .95) < 1e-3, np.sort(off)[-10:]


@pytest.mark.parametrize('pair', PAIRS)
def test_the_gap_has_no_jumps_near_touch(pair):
    # in 1e-5 s no point of a moves by more than 2e-5 m
    rng, h = np.random.default_rng(7), 1e-5
    for _ in range(20):
        a, b = touching(rng, *pair, -1e-4)
        v, w = rng.normal(size=3), rng.normal(size=3)
        v, w = v / np.linalg.norm(v), w / np.linalg.norm(w)
        course = [gap(a.moved(v * h * k, w * h * k), b) for k in range(-25, 25)]
        assert np.abs(np.diff(course)).max() < 2e-5


@pytest.mark.parametrize('pair', list(itertools.product(KINDS, KINDS)))
def test_no_overlap_is_too_deep(pair):
    rng = np.random.default_rng(8)
    for k in range(1250):
        a, b = any_body(rng, pair[0], .1 * (k % 3)), any_body(rng, pair[1])
        if k % 5 == 0:
            a.turn = b.turn
        if k % 7 == 0:
            tilt = rng.normal(size=3) * 10.0 ** -rng.integers(4, 17)
            a.turn = b.turn * Rotation.from_rotvec(tilt)
        if k % 11 == 0:
            a.turn = b.turn * Rotation.from_rotvec([math.pi / 2, 0, 0])
        assert math.isfinite(gap(a, b))
        assert (len(contacts(a, b, 0)) > 0) == (gap(a, b) <= 0)


@pytest.mark.parametrize('pair', PAIRS)
def test_along_the_normal_overlapped_bodies_come_apart(pair):
    rng = np.random.default_rng(9)
    for _ in range(200):
        a, b = any_body(rng, pair[0], .05), any_body(rng, pair[1])
        for _ in range(60):
            found = contacts(a, b, 0)
            if not len(found):
                break
            deep = found[found['gap'].argmin()]
            a = a.moved(deep['normal'] * (1e-9 - deep['gap']))
        assert gap(a, b) > 0


def square(half, height):
    return [[-half, -half, height], [-half, half, height], [half, -half, height],
            [half, half, height]]


@pytest.mark.parametrize('depth', [1e-4, 0.0, -2e-4])
def test_a_box_on_a_box_of_its_size_stands_on_four_corners(depth):
    found = contacts(Body(BOX, [.1, .1, .1], [0, 0, .2 - depth]), Body(BOX, [.1, .1, .1]))
    assert np.sort(places(found), axis=0) == pytest.approx(
        np.sort(np.array(square(.1, .1 - depth / 2)), axis=0), abs=1e-12)
    assert found['normal'] == pytest.approx(np.tile([0, 0, 1], (4, 1)))
    assert found['gap'] == pytest.approx(-depth, abs=1e-12)


def test_a_tilt_of_rounding_leaves_four_corners_and_their_names():
    rng, names = np.random.default_rng(10), set()
    for _ in range(200):
        tilt = Rotation.from_rotvec(rng.normal(size=3) * 10.0 ** -rng.integers(6, 17))
        found = contacts(Body(BOX, [.1, .1, .1], [.03, .02, .2], tilt), Body(BOX, [.1, .1, .1]))
        assert len(found) == 4 and found['normal'][:, 2] == pytest.approx(1, abs=1e-9)
        names.add(tuple(np.sort(found['feature_id'])))
    assert len(names) <= 2      # one for each of the faces that may be the reference


def test_a_turned_box_on_a_box_stands_on_an_octagon():
    a = Body(BOX, [.1, .1, .1], [0, 0, .2], Rotation.from_euler('z', math.pi / 4))
    found = contacts(a, Body(BOX, [.1, .1, .1]))
    assert len(found) == 8
    # corners of the octagon within both squares are at .1 and .1 (sqrt 2 - 1)
    near = .1 * (math.sqrt(2) - 1)
    assert np.sort(np.abs(found['point'][:, :2]), axis=1) == pytest.approx(
        np.tile([near, .1], (8, 1)))


def test_a_box_on_its_edge_touches_at_two_points():
    a = Body(BOX, [.1, .2, .1], [.05, 0, .1 + .1 * math.sqrt(2)],
             Rotation.from_euler('y', math.pi / 4))
    assert places(contacts(a, Body(BOX, [.5, .5, .1]))) == pytest.approx(
        np.array([[.05, -.2, .1], [.05, .2, .1]]))
    # and where the edge stands out over the face it ends with the face
    found = contacts(a, Body(BOX, [.5, .15, .1]))
    assert np.sort(found['point'][:, 1]) == pytest.approx([-.15, .15])


def test_edges_that_cross_touch_where_they_cross():
    a = Body(BOX, [.1, .3, .1], [.02, .03, .2 * math.sqrt(2) - 1e-4],
             Rotation.from_euler('y', math.pi / 4))
    b = Body(BOX, [.3, .1, .1], [0, 0, 0], Rotation.from_euler('x', math.pi / 4))
    found = contacts(a, b)
    assert np.column_stack([found['point'], found['normal'], found['gap']]) == pytest.approx(
        np.array([[.02, 0, .1 * math.sqrt(2) - 5e-5, 0, 0, 1, -1e-4]]), abs=1e-12)


@pytest.mark.parametrize('kind', [CAPSULE, CYLINDER])
def test_what_lies_on_a_box_touches_at_two_points(kind):
    lying = Rotation.from_euler('y', math.pi / 2)
    a = Body(kind, [.05, .2], [.1, .03, .15 - 1e-5], lying)
    found = contacts(a, Body(BOX, [.5, .5, .1]))
    assert places(found) == pytest.approx(
        np.array([[-.1, .03, .1 - 5e-6], [.3, .03, .1 - 5e-6]]), abs=1e-9)
    # half of it is over the edge
    assert places(contacts(a, Body(BOX, [.1, .5, .1])))[:, 0] == pytest.approx([-.1, .1])
    # one end up by less than the margin: both are told, each with its gap
    tilted = a.moved([0, 0, 0], [0, -1e-3, 0])
    found = contacts(tilted, Body(BOX, [.5, .5, .1]))
    assert np.sort(found['gap']) == pytest.approx([-1e-5 - 2e-4, -1e-5 + 2e-4], abs=1e-6)


@pytest.mark.parametrize('kinds', list(itertools.product([CAPSULE, CYLINDER], repeat=2)))
def test_side_by_side_they_touch_at_two_points(kinds):
    a, b = Body(kinds[0], [.05, .2], [.09999, 0, .1]), Body(kinds[1], [.05, .3])
    assert np.sort(contacts(a, b)['point'][:, 2]) == pytest.approx([-.1, .3])
    assert contacts(a, b)['normal'][:, 0] == pytest.approx(1)
    across = Body(kinds[0], [.05, .2], [.1, .02, .1], Rotation.from_euler('x', math.pi / 2))
    assert contacts(across, b)['point'] == pytest.approx(np.array([[.05, 0, .1]]), abs=1e-9)


def test_a_cylinder_stands_on_its_rim():
    a = Body(CYLINDER, [.1, .2], [.02, 0, .3])
    x, y, z = contacts(a, Body(BOX, [.5, .5, .1]))['point'].T
    assert len(z) == 8 and np.ptp(z) < 1e-12
    angles = np.sort(np.arctan2(y, x - .02))
    assert np.hypot(x - .02, y) == pytest.approx(.1)
    assert np.diff(angles) == pytest.approx(math.pi / 4)
    # on a smaller box: the box's corners, which all lie under the disc
    assert len(contacts(a, Body(BOX, [.05, .05, .1]))) == 4
    # on another cylinder: as much as the smaller has
    x, y, _ = contacts(a, Body(CYLINDER, [.3, .1]))['point'].T
    assert np.hypot(x - .02, y) == pytest.approx(.1) and len(x) == 8


@pytest.mark.parametrize('degrees', [1e-5, .01, 1, 30, 80])
def test_a_tilted_cylinder_stands_where_its_rim_is_lowest(degrees):
    rng = np.random.default_rng(11)
    for _ in range(20):
        tilt, about = math.radians(degrees), rng.uniform(0, 2 * math.pi)
        turn = Rotation.from_euler('zyz', [rng.uniform(0, 6), tilt, about])
        high = .2 * math.cos(tilt) + .1 * math.sin(tilt)
        a = Body(CYLINDER, [.1, .2], [0, 0, .1 + high], turn)
        found = contacts(a, Body(BOX, [.9, .9, .1]), 1e-7)
        deep = found[found['gap'].argmin()]
        down = turn.inv().apply([0, 0, -1])
        rim = [.1 * down[0] / math.sin(tilt), .1 * down[1] / math.sin(tilt), -.2]
        assert deep['point'] == pytest.approx(a.centre + turn.apply(rim), abs=1e-9)
        assert abs(deep['gap']) < 1e-12


def test_contacts_keep_their_names_while_a_box_slides():
    names = {tuple(np.sort(contacts(Body(BOX, [.1, .1, .1], [.01 * k, .05, .2], Rotation.from_euler(
        'z', .3)), Body(BOX, [.5, .5, .1]))['feature_id'])) for k in range(30)}
    assert len(names) == 1


def test_the_same_bodies_have_the_same_bits():
    rng = np.random.default_rng(12)
    for pair in PAIRS:
        a, b = touching(rng, *pair, -1e-5)
        assert contacts(a, b).tobytes() == contacts(a, b).tobytes()


@pytest.mark.parametrize('kind', KINDS)
def test_the_hull_of_a_boxs_corners_collides_as_the_box(kind):
    """Apart, touching and deep; its gap, normals, points and how deep each is."""
    rng = np.random.default_rng(12)
    half = (.15, .2, .1)
    tables = hull_tables(Hull(*Box(tuple(2 * x for x in half)).mesh()))
    system = blank_system()._replace(**tables._asdict())
    rows = bind(system)
    touched = 0
    for _ in range(300):
        a, turn = any_body(rng, kind, .2), Rotation.random(random_state=rng)
        box = Body(BOX, half, (0, 0, 0), turn)
        hull = Shape(HULL, (float(tables.hulls['size'][0]), 0.0, 0.0), (0.0, 0.0, 0.0),
                     box.shape.rotation, (0.0, 0.0, 0.0), int(rows[0].ctypes.data), 0)
        due, found = gap(a, box), _separation(a.shape, hull)
        # of two boxes apart an axis of SAT is taken, which is nearer than the distance; with a rim
        # the search ends at one of several axes of largest separation, where both are deep
        if due > 0 and kind == BOX:
            assert found >= due - 1e-12
            continue
        if kind == CYLINDER and due < -.05:
            continue
        assert found == pytest.approx(due, abs=1e-9)
        out = np.zeros((2, MAX_MANIFOLD_POINTS), CONTACT_POINT)
        one, other = (rows[:_collide(a.shape, b, 1e-3, rows)] for b, rows in zip(
            (box.shape, hull), out, strict=True))
        if not len(one) or np.abs(one['normal'][0] - other['normal'][0]).max() > 1e-6:
            # a tie of two axes that are as good, within the bias of faces
            continue
        touched += 1
        if kind == HULL:
            # Which face of a stone meets it beside an edge that is deepest, rounding says.
            assert other['gap'].min() == pytest.approx(one['gap'].min(), abs=1e-9)
            continue
        assert len(other) == len(one)
        assert places(other) == pytest.approx(places(one), abs=1e-6)
        assert np.sort(other['gap']) == pytest.approx(np.sort(one['gap']), abs=1e-9)
    assert touched > 30


def test_a_prism_of_many_sides_stands_on_eight_corners_of_its_face():
    """Those that are farthest along eight directions: its centre is well within them."""
    number = len(HULLS) - 1
    prism = a_hull(number, (0, 0, .12 - 1e-6), UPRIGHT)
    found = contacts(prism, Body(BOX, (1, 1, .5), (0, 0, -.5)))
    assert len(found) == 8 and found['gap'] == pytest.approx(np.full(8, -1e-6), abs=1e-9)
    corners = HULLS[number].vertices[HULLS[number].vertices[:, 2] < 0][:, :2]
    apart = np.linalg.norm(found['point'][:, None, :2] - corners, axis=2).min(axis=1)
    assert apart.max() < 1e-9
    turns = np.sort(np.arctan2(*found['point'][:, :2].T))
    assert np.diff(turns, append=turns[0] + 2 * math.pi).max() < math.pi / 2
