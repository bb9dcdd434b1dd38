"""Arms that many tests need, built by hand so that they do not depend on how a robot file is read."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tauscope.robot.robot import Joint, JointType, LinkInertia, Placement, Robot, Segment

Array = NDArray[np.float64]

_IDENTITY = Placement()


def rotation_x(angle: float) -> Array:
    """Rotation about the x axis."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])


def rotation_z(angle: float) -> Array:
    """Rotation about the z axis."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def dh_segment(theta: float, d: float, a: float, alpha: float, joint_type: JointType = JointType.REVOLUTE) -> Segment:
    """One row of standard Denavit-Hartenberg parameters: Rz(θ + q) Tz(d) Tx(a) Rx(α), or Tz(d + q) when prismatic."""
    after = Placement(rotation_x(alpha), np.array([a, 0.0, d]))
    return Segment(joint_type, Placement(rotation_z(theta), np.zeros(3)) if theta else _IDENTITY, after)


def mdh_segment(theta: float, d: float, a: float, alpha: float, joint_type: JointType = JointType.REVOLUTE) -> Segment:
    """One row of modified Denavit-Hartenberg parameters: Rx(α) Tx(a) Rz(θ + q) Tz(d)."""
    before_rotation = rotation_x(alpha)
    translation = np.array([a, 0.0, 0.0]) + before_rotation @ np.array([0.0, 0.0, d])
    return Segment(joint_type, Placement(before_rotation @ rotation_z(theta), translation), _IDENTITY)


def arm(name: str, segments: Sequence[Segment], gravity: Sequence[float] = (0.0, 0.0, -9.81)) -> Robot:
    """A robot of these segments, its joints named joint1, joint2, …"""
    joints = tuple(Joint(f"joint{j + 1}", segment.type) for j, segment in enumerate(segments))
    return Robot(name, joints, tuple(segments), np.array(gravity, dtype=float))


def paper_arm(alpha: float = np.pi / 2, theta: float = np.pi / 2) -> Robot:
    """The seed paper's arm, its Table 1; the arguments let a test write π/2 with fewer digits."""
    rows = ((0.0, 0.3, 0.0, alpha), (theta, 0.0, 0.5, 0.0), (0.0, 0.0, 0.5, 0.0))
    return arm("paper", [dh_segment(*row) for row in rows])


def paper_parameters() -> Array:
    """Standard parameters of the paper's arm, (30,): links 2 and 3 slender rods of √2 kg and 0.5 m, centre at -a/2."""
    mass, length = np.sqrt(2.0), 0.5
    moment = mass * length**2 / 3
    rod = LinkInertia(mass, np.array([-mass * length / 2, 0.0, 0.0]), np.diag([0.0, moment, moment]))
    return np.concatenate([np.zeros(10), rod.to_vector(), rod.to_vector()])


def ur5_like(alpha: float = np.pi / 2) -> Robot:
    """Six revolute joints with the UR5's published Denavit-Hartenberg parameters."""
    rows = (
        (0.0, 0.089159, 0.0, alpha),
        (0.0, 0.0, -0.425, 0.0),
        (0.0, 0.0, -0.39225, 0.0),
        (0.0, 0.10915, 0.0, alpha),
        (0.0, 0.09465, 0.0, -alpha),
        (0.0, 0.0823, 0.0, 0.0),
    )
    return arm("ur5-like", [dh_segment(*row) for row in rows])


def panda_like(alpha: float = np.pi / 2) -> Robot:
    """Seven revolute joints with the Panda's published modified Denavit-Hartenberg parameters."""
    rows = (
        (0.0, 0.333, 0.0, 0.0),
        (0.0, 0.0, 0.0, -alpha),
        (0.0, 0.316, 0.0, alpha),
        (0.0, 0.0, 0.0825, alpha),
        (0.0, 0.384, -0.0825, -alpha),
        (0.0, 0.0, 0.0, alpha),
        (0.0, 0.0, 0.088, alpha),
    )
    return arm("panda-like", [mdh_segment(*row) for row in rows])


def emps_like() -> Robot:
    """One prismatic axis, gravity perpendicular to it."""
    return arm("emps-like", [dh_segment(0.0, 0.0, 0.0, 0.0, JointType.PRISMATIC)], gravity=(0.0, -9.81, 0.0))


def random_rotation(rng: np.random.Generator) -> Array:
    """A rotation drawn uniformly."""
    w, x, y, z = (q := rng.normal(size=4)) / np.linalg.norm(q)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def _random_placement(rng: np.random.Generator) -> Placement:
    return Placement(random_rotation(rng), rng.uniform(-0.5, 0.5, 3))


def random_arm(rng: np.random.Generator, joint_count: int) -> Robot:
    """A chain of revolute and prismatic joints in general position, with gravity in any direction."""
    types = rng.choice([JointType.REVOLUTE, JointType.REVOLUTE, JointType.PRISMATIC], joint_count)
    segments = [Segment(JointType(kind), _random_placement(rng), _random_placement(rng)) for kind in types]
    return arm("random", segments, gravity=tuple(rng.uniform(-10, 10, 3)))


def random_link(rng: np.random.Generator) -> LinkInertia:
    """A physically possible link: twenty point masses around the link frame."""
    masses, points = rng.uniform(0.05, 0.5, 20), rng.normal(scale=0.1, size=(20, 3)) + rng.uniform(-0.3, 0.3, 3)
    second = np.einsum("p,pi,pj->ij", masses, points, points)
    return LinkInertia(float(masses.sum()), masses @ points, np.trace(second) * np.eye(3) - second)


def random_parameters(rng: np.random.Generator, joint_count: int) -> Array:
    """Standard parameters of physically possible links, shape (10 n,)."""
    return np.concatenate([random_link(rng).to_vector() for _ in range(joint_count)])


def random_states(rng: np.random.Generator, samples: int, joint_count: int) -> tuple[Array, Array, Array]:
    """Positions, velocities and accelerations, each (N, n)."""
    shape = (samples, joint_count)
    return rng.uniform(-np.pi, np.pi, shape), rng.normal(scale=2.0, size=shape), rng.normal(scale=5.0, size=shape)
