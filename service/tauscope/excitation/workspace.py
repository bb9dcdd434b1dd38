"""Where the arm must not go: below a floor, or into boxes; seen from its joint origins and its tool."""

from dataclasses import dataclass, field

import numpy as np

from tauscope.errors import ExcitationError
from tauscope.excitation.information import MotionGradient
from tauscope.robot import JointType, Robot
from tauscope.robot.kinematics import homogeneous, link_placements
from tauscope.robot.robot import Array
from tauscope.trajectory.fourier_series import MotionSamples

REFERENCE_M = 0.1  # clearance from which nothing is said to be used of it; at zero clearance all of it is [m]
STILL_M = 1e-9  # a point that moves less than this is fixed to the base: where it stands is nobody's choice [m]


@dataclass(frozen=True, eq=False)
class Box:
    """A forbidden box, its sides along the axes of the base frame. `low`, `high`: (3,), opposite corners [m]."""

    low: Array
    high: Array

    def __post_init__(self) -> None:
        shaped = np.shape(self.low) == (3,) and np.shape(self.high) == (3,)
        if not shaped or not np.isfinite([self.low, self.high]).all() or not np.less(self.low, self.high).all():
            raise ExcitationError(
                f"box from {np.asarray(self.low).tolist()} to {np.asarray(self.high).tolist()}: "
                "give two corners x,y,z, the lower one first"
            )


@dataclass(frozen=True, eq=False)
class Workspace:
    """What the arm's joint origins and tool have to keep clear of."""

    floor_m: float | None = None  # lowest height z in the base frame [m]; None where there is no floor
    boxes: tuple[Box, ...] = ()
    tool_m: Array = field(default_factory=lambda: np.zeros(3))  # (3,), tool point in the last link's frame [m]

    def __post_init__(self) -> None:
        """Refuse numbers that are no place."""
        if self.floor_m is not None and not np.isfinite(self.floor_m):
            raise ExcitationError(f"the floor is at {self.floor_m} m; give a height in the base frame")
        if np.shape(self.tool_m) != (3,) or not np.isfinite(self.tool_m).all():
            raise ExcitationError("the tool point needs three finite coordinates x,y,z [m]")

    @property
    def is_open(self) -> bool:
        """Whether nothing is forbidden."""
        return self.floor_m is None and not self.boxes


@dataclass(frozen=True, eq=False)
class _Point:
    """A point of the arm: in frame `link` (or in the joint frame before it), moved by the first `joints` joints."""

    name: str
    link: int
    in_joint_frame: bool
    offset: Array
    joints: int


@dataclass(frozen=True, eq=False)
class _Chain:
    """Frames of the arm at N postures: joints' frames before their motion, and link frames, (N, n, 4, 4) each."""

    joints: Array
    links: Array


class WorkspaceUsage:
    """How near the arm comes to what is forbidden: 0 from `REFERENCE_M` on, 1 where it touches."""

    def __init__(self, robot: Robot, workspace: Workspace) -> None:
        self._robot = robot
        self._workspace = workspace
        self._sliding = np.array([segment.type is JointType.PRISMATIC for segment in robot.segments])
        self._before = np.stack([homogeneous(segment.before) for segment in robot.segments])
        self._points = self._moving_points()

    @property
    def names(self) -> tuple[str, ...]:
        """What each column of `usage` compares: a point and an obstacle."""
        obstacles = [] if self._workspace.floor_m is None else ["the floor"]
        obstacles += [f"box {place + 1}" for place in range(len(self._workspace.boxes))]
        return tuple(f"{point.name} and {obstacle}" for obstacle in obstacles for point in self._points)

    def clearance(self, position: Array) -> Array:
        """Distance of points from obstacles, negative within, (N, obstacles × points) [m], by `position`, (N, n)."""
        points = self._places(self._frames(position))
        columns = [] if self._workspace.floor_m is None else [points[..., 2] - self._workspace.floor_m]
        for box in self._workspace.boxes:
            columns.append(_beyond(box, points).max(axis=-1))
        return np.concatenate(columns, axis=1) if columns else np.empty((len(position), 0))

    def usage(self, motion: MotionSamples, _base: Array | None = None) -> Array:
        """1 - clearance / `REFERENCE_M`, not below 0, (N, obstacles × points)."""
        return np.maximum(1.0 - self.clearance(motion.position) / REFERENCE_M, 0.0)

    def pull_back(self, motion: MotionSamples, _base: Array, weight: Array) -> MotionGradient:
        """Derivatives of Σ `weight` (N, obstacles × points) · usage; `_base` (n, m, N) is not needed."""
        chain = self._frames(motion.position)
        points = self._places(chain)
        force = np.zeros_like(points)
        columns = iter(np.split(-weight / REFERENCE_M, max(weight.shape[1] // len(self._points), 1), axis=1))
        if self._workspace.floor_m is not None:
            force[..., 2] += next(columns)
        for box in self._workspace.boxes:
            beyond = _beyond(box, points)
            axis = np.argmax(beyond, axis=-1)[..., None]
            side = np.sign(np.take_along_axis(points - 0.5 * (box.low + box.high), axis, axis=-1))
            sloped = np.zeros_like(points)
            np.put_along_axis(sloped, axis, side * next(columns)[..., None], axis=-1)
            force += sloped
        gradient = np.zeros((len(points), self._robot.link_count))
        axes, origins = chain.joints[..., :3, 2], chain.joints[..., :3, 3]
        for place, point in enumerate(self._points):
            arm = points[:, place, None] - origins[:, : point.joints]
            moment = np.cross(arm, force[:, place, None])
            push = np.where(self._sliding[: point.joints, None], force[:, place, None], moment)
            gradient[:, : point.joints] += (axes[:, : point.joints] * push).sum(axis=-1)
        gradient = gradient @ self._robot.ratios
        zero = np.zeros_like(gradient)
        return MotionGradient(gradient, zero, zero)

    def _frames(self, position: Array) -> _Chain:
        links = link_placements(self._robot, position)
        joints = np.empty_like(links)
        joints[:, 0] = self._before[0]
        joints[:, 1:] = links[:, :-1] @ self._before[1:]
        return _Chain(joints, links)

    def _places(self, chain: _Chain) -> Array:
        places = np.empty((len(chain.links), len(self._points), 3))
        for place, point in enumerate(self._points):
            frame = (chain.joints if point.in_joint_frame else chain.links)[:, point.link]
            places[:, place] = frame[:, :3, :3] @ point.offset + frame[:, :3, 3]
        return places

    def _moving_points(self) -> list[_Point]:
        """Origins of the joints' and links' frames, and the tool, without those that stand still or coincide."""
        robot, zero = self._robot, np.zeros(3)
        points = []
        for j in range(robot.link_count):
            points.append(_Point(f"the origin of {robot.joint_of_link(j).name}", j, True, zero, j))
            last = j == robot.link_count - 1
            offset = self._workspace.tool_m if last else zero
            points.append(_Point("the tool" if last else f"the end of link {j + 1}", j, False, offset, j + 1))
        self._points = points
        rng = np.random.default_rng(0)
        samples = self._places(self._frames(rng.uniform(-1.0, 1.0, (8, robot.joint_count))))
        kept: list[int] = []
        for place in range(len(points)):
            moves = np.ptp(samples[:, place], axis=0).max() > STILL_M
            known = any(np.abs(samples[:, place] - samples[:, other]).max() <= STILL_M for other in kept)
            if moves and not known:
                kept.append(place)
        return [points[place] for place in kept]


def _beyond(box: Box, points: Array) -> Array:
    return np.abs(points - 0.5 * (box.low + box.high)) - 0.5 * (box.high - box.low)
