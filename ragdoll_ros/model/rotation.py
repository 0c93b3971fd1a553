"""Rotations as unit quaternions x, y, z, w (as in ROS) that map body to world: v_world = R v_body.

Functions take stacked input: quaternions (..., 4), vectors (..., 3), matrices (..., 3, 3).
"""
import math
from decimal import Context, Decimal, localcontext

import numpy as np
from numpy.typing import ArrayLike

IDENTITY = (0.0, 0.0, 0.0, 1.0)

TWO_PI = Decimal('6.2831853071795864769252867665590057683943387987502')

DIGITS_50 = Context(prec=50)

LARGE_TURNS = 1e6


def sine_and_cosine(angle: float) -> tuple[float, float]:
    """Sine and cosine of a finite angle in rad, by the Taylor series in 50 digits, rounded once.

    They have the same bits with every C library and processor: initial states are computed with
    them, so that simulations agree to the bit across machines. An angle of more than LARGE_TURNS
    turns is first reduced modulo a turn in float64.
    """
    if abs(angle) > LARGE_TURNS * math.tau:
        angle = math.fmod(angle, math.tau)
    with localcontext(DIGITS_50):
        x, sums, term = Decimal(float(angle)) % TWO_PI, [Decimal(0), Decimal(0)], Decimal(1)
        for k in range(64):
            sums[k % 2] += -term if k & 2 else term
            term *= x / (k + 1)
    cosine, sine = map(float, sums)
    return sine, cosine


def _hamilton() -> np.ndarray:
    """Matrix (16, 4) from the products a_i b_j to the quaternion a * b."""
    x, y, z, w = range(4)
    terms = [((w, x, 1), (x, w, 1), (y, z, 1), (z, y, -1)),
             ((w, y, 1), (x, z, -1), (y, w, 1), (z, x, 1)),
             ((w, z, 1), (x, y, 1), (y, x, -1), (z, w, 1)),
             ((w, w, 1), (x, x, -1), (y, y, -1), (z, z, -1))]
    return _table(terms)


def _table(terms: list[tuple[tuple[int, int, int], ...]]) -> np.ndarray:
    table = np.zeros((16, len(terms)))
    for entry, sums in enumerate(terms):
        for i, j, factor in sums:
            table[4 * i + j, entry] = factor
    return table


_HAMILTON = _hamilton()


def multiply(a: ArrayLike, b: ArrayLike) -> np.ndarray:
    """Hamilton product a * b: the rotation b, then a."""
    products = np.asarray(a, float)[..., :, None] * np.asarray(b, float)[..., None, :]
    return products.reshape(*products.shape[:-2], 16) @ _HAMILTON


def inverse(q: ArrayLike) -> np.ndarray:
    """Inverse of unit quaternions."""
    return np.asarray(q, float) * (-1.0, -1.0, -1.0, 1.0)


def normalized(q: ArrayLike) -> np.ndarray:
    """Quaternions or vectors scaled to length one."""
    q = np.asarray(q, float)
    return q / np.linalg.norm(q, axis=-1, keepdims=True)


def _products_to_matrix() -> np.ndarray:
    """Matrix (16, 9) from the products q_i q_j to the entries of the rotation matrix."""
    x, y, z, w = range(4)
    terms = [((x, x, 1), (y, y, -1), (z, z, -1), (w, w, 1)), ((x, y, 2), (z, w, -2)),
             ((x, z, 2), (y, w, 2)),
             ((x, y, 2), (z, w, 2)), ((x, x, -1), (y, y, 1), (z, z, -1), (w, w, 1)),
             ((y, z, 2), (x, w, -2)),
             ((x, z, 2), (y, w, -2)), ((y, z, 2), (x, w, 2)),
             ((x, x, -1), (y, y, -1), (z, z, 1), (w, w, 1))]
    return _table(terms)


_PRODUCTS = _products_to_matrix()


def matrix(q: ArrayLike) -> np.ndarray:
    """Rotation matrices (..., 3, 3) of unit quaternions.

    By einsum, whose order of summation is fixed; that of BLAS depends on the processor.
    """
    q = np.asarray(q, float)
    products = (q[..., :, None] * q[..., None, :]).reshape(*q.shape[:-1], 16)
    return np.einsum('...i,ij->...j', products, _PRODUCTS).reshape(*q.shape[:-1], 3, 3)


def rotate(q: ArrayLike, v: ArrayLike) -> np.ndarray:
    """Vectors v from the body's axes to the outer axes."""
    return np.einsum('...ij,...j->...i', matrix(q), np.asarray(v, float))


def from_matrix(r: ArrayLike) -> np.ndarray:
    """Unit quaternions (..., 4) of rotation matrices (..., 3, 3); w >= 0.

    Starts from the largest component, for accuracy (Shepperd 1978).
    """
    r = np.moveaxis(np.asarray(r, float), (-2, -1), (0, 1))
    trace = r[0, 0] + r[1, 1] + r[2, 2]
    squares = np.array([1 + 2 * r[0, 0] - trace, 1 + 2 * r[1, 1] - trace,
                        1 + 2 * r[2, 2] - trace, 1 + trace])
    rows = np.array([
        [squares[0], r[0, 1] + r[1, 0], r[0, 2] + r[2, 0], r[2, 1] - r[1, 2]],
        [r[0, 1] + r[1, 0], squares[1], r[1, 2] + r[2, 1], r[0, 2] - r[2, 0]],
        [r[0, 2] + r[2, 0], r[1, 2] + r[2, 1], squares[2], r[1, 0] - r[0, 1]],
        [r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1], squares[3]]])
    largest = np.argmax(squares, axis=0)[None, None]
    q = normalized(np.moveaxis(np.take_along_axis(rows, largest, axis=0)[0], 0, -1))
    return np.where(q[..., 3:] >= 0, q, -q)


def nearest_rotation(matrix: ArrayLike) -> np.ndarray:
    """Quaternions (..., 4) of the rotations nearest to matrices (..., 3, 3) with scale or
    reflection.
    """
    u, _, vt = np.linalg.svd(matrix)
    mirrored = np.linalg.det(u @ vt) < 0
    if mirrored.any():
        u = np.where(mirrored[..., None, None], u * (1.0, 1.0, -1.0), u)
    return from_matrix(u @ vt)


def nearest_rotation_spin(changed: ArrayLike, rate: ArrayLike) -> np.ndarray:
    """Angular velocities (..., 3) of nearest_rotation() of matrices A (..., 3, 3), outer axes.

    ``rate`` is dA/dt. With A = R P, P symmetric, and the spin w in the body's axes, R^T dA/dt - its
    transpose = [w] P + P [w] = [(trace(P) - P) w]. Where the nearest rotation is not unique, as for
    A = 0, the smallest solution w.
    """
    r = matrix(nearest_rotation(changed))
    back = np.swapaxes(r, -1, -2)
    stretch, turned = back @ np.asarray(changed, float), back @ np.asarray(rate, float)
    odd = turned - np.swapaxes(turned, -1, -2)
    trace = np.trace(stretch, axis1=-2, axis2=-1)[..., None, None]
    body = np.linalg.pinv(trace * np.eye(3) - (stretch + np.swapaxes(stretch, -1, -2)) / 2,
                          rcond=1e-15, hermitian=True) @ np.stack(
        [odd[..., 2, 1], odd[..., 0, 2], odd[..., 1, 0]], axis=-1)[..., None]
    return (r @ body)[..., 0]


def from_axis_angle(axis: ArrayLike, angle: float) -> np.ndarray:
    """Unit quaternion (4,) of a rotation by ``angle`` rad about ``axis``, right-handed."""
    sine, cosine = sine_and_cosine(angle / 2)
    return np.append(normalized(axis) * sine, cosine)


def from_rotation_vector(vectors: ArrayLike) -> np.ndarray:
    """Unit quaternions (..., 4) of rotation vectors (..., 3) in rad."""
    vectors = np.asarray(vectors, float)
    half = np.linalg.norm(vectors, axis=-1, keepdims=True) / 2
    return np.concatenate([np.sinc(half / np.pi) / 2 * vectors, np.cos(half)], axis=-1)


def mean_rotation_matrix(vector: ArrayLike) -> np.ndarray:
    """Mean (3, 3) of the rotation matrices of s r, s from 0 to 1, for a rotation vector r (3,).

    The left Jacobian of SO(3): 1 + (1 - cos a)/a^2 [r] + (a - sin a)/a^3 [r]^2, a = |r|.
    """
    x, y, z = vector
    angle = math.hypot(x, y, z)
    across = np.array(((0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0)))
    if angle < 1e-4:
        return np.eye(3) + across / 2 + across @ across / 6
    return (np.eye(3) + (1 - math.cos(angle)) / angle ** 2 * across
            + (angle - math.sin(angle)) / angle ** 3 * across @ across)


def rotation_vector(q: ArrayLike) -> np.ndarray:
    """Rotation vectors (..., 3) in rad, at most pi long, of unit quaternions (..., 4)."""
    q = np.asarray(q, float)
    q = np.where(q[..., 3:] < 0, -q, q)
    sin = np.linalg.norm(q[..., :3], axis=-1, keepdims=True)
    return q[..., :3] * 2 / np.sinc(np.arctan2(sin, q[..., 3:]) / np.pi)


def from_rpy(roll: float, pitch: float, yaw: float) -> np.ndarray:
    """Unit quaternion of URDF's and REP 103's fixed-axis roll, pitch, yaw in rad."""
    turns = ((2, yaw), (1, pitch), (0, roll))
    q = np.array(IDENTITY)
    for axis, angle in turns:
        q = multiply(q, from_axis_angle(np.eye(3)[axis], angle))
    return q


def to_rpy(q: ArrayLike) -> tuple[float, float, float]:
    """Fixed-axis roll, pitch, yaw in rad of one quaternion, exact at pitch = 90 degrees too.

    Roll is computed after yaw is removed, so that the two are consistent at the singularity.
    """
    r = matrix(q)
    yaw = math.atan2(r[1, 0], r[0, 0])
    pitch = math.atan2(-r[2, 0], math.hypot(r[0, 0], r[1, 0]))
    sin, cos = math.sin(yaw), math.cos(yaw)
    roll = math.atan2(sin * r[0, 2] - cos * r[1, 2], cos * r[1, 1] - sin * r[0, 1])
    return roll, pitch, yaw


def from_euler_xyz(x: float, y: float, z: float) -> np.ndarray:
    """Unit quaternion (4,) of intrinsic Euler angles x, y, z in rad: R = Rx Ry Rz."""
    q = np.array(IDENTITY)
    for axis, angle in zip(np.eye(3), (x, y, z), strict=True):
        q = multiply(q, from_axis_angle(axis, angle))
    return q


def to_euler_xyz(q: ArrayLike) -> tuple[float, float, float]:
    """Intrinsic Euler angles x, y, z in rad of one quaternion: R = Rx Ry Rz."""
    r = matrix(q)
    return (math.atan2(-r[1, 2], r[2, 2]), math.asin(max(-1.0, min(1.0, r[0, 2]))),
            math.atan2(-r[0, 1], r[0, 0]))


def euler_xyz_rates(angles: ArrayLike, spin: ArrayLike) -> np.ndarray:
    """Rates (3,) rad/s of intrinsic Euler angles at the angular velocity ``spin`` (3,) rad/s in
    body axes; singular where the second angle is 90 degrees.
    """
    _, second, third = angles
    sin, cos = math.sin(third), math.cos(third)
    first_rate = (spin[0] * cos - spin[1] * sin) / math.cos(second)
    return np.array([first_rate, spin[0] * sin + spin[1] * cos,
                     spin[2] - first_rate * math.sin(second)])


def euler_xyz_spin(angles: ArrayLike, rates: ArrayLike) -> np.ndarray:
    """Angular velocity (3,) rad/s in body axes at the ``rates`` (3,) rad/s of intrinsic Euler
    angles: the inverse of euler_xyz_rates.
    """
    _, second, third = angles
    sin, cos = math.sin(third), math.cos(third)
    first_rate = rates[0] * math.cos(second)
    return np.array([first_rate * cos + rates[1] * sin, rates[1] * cos - first_rate * sin,
                     rates[2] + rates[0] * math.sin(second)])


def angle_between(a: ArrayLike, b: ArrayLike) -> np.ndarray:
    """Geodesic distance of unit quaternions in rad, 0 to pi; q and -q are the same rotation."""
    difference = multiply(inverse(a), b)
    sin = np.linalg.norm(difference[..., :3], axis=-1)
    return 2 * np.arctan2(sin, np.abs(difference[..., 3]))


def shortest_arc(a: ArrayLike, b: ArrayLike) -> np.ndarray:
    """Quaternion (4,) of the smallest rotation from the direction of a to that of b."""
    a, b = normalized(a), normalized(b)
    q = np.append(np.cross(a, b), 1 + a @ b)
    if np.linalg.norm(q) > 1e-8:
        return normalized(q)
    across = np.eye(3)[np.argmin(np.abs(a))]
    return np.append(normalized(np.cross(a, across)), 0.0)
