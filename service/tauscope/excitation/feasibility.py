"""Motions that keep all limits: where to begin, how to come back to them, and why there may be none."""

from dataclasses import dataclass

import numpy as np

from tauscope.errors import ExcitationError
from tauscope.excitation.constraints import KinematicUsage, StateUsage
from tauscope.excitation.series_space import SeriesGrid, SeriesSpace
from tauscope.robot import Robot
from tauscope.robot.robot import Array
from tauscope.trajectory.fourier_series import MotionSamples
from tauscope.trajectory.limits import MotionLimits
from tauscope.trajectory.servo_bounds import BOUNDS

POSTURES = 2048  # random postures at which is asked whether the arm can stand there at all
LEAST_HALF_RANGE = 1e-3  # half range below which a joint has no room to move [rad or m]
LEAST_HARMONIC = 0.3  # smallest amplitude of a random start, as part of what the joints' own limits allow
BISECTIONS = 12  # halvings between a feasible and an infeasible motion
SETTLED = 0.999  # usage that is aimed at where torque or workspace bind: what lies between samples has the rest


@dataclass(frozen=True, eq=False)
class Feasibility:
    """What is feasible in one space of series."""

    robot: Robot
    space: SeriesSpace
    grid: SeriesGrid
    limits: MotionLimits
    kinematics: KinematicUsage
    states: StateUsage

    def standing_postures(self, rng: np.random.Generator) -> Array:
        """Where the arm may stand, (K, n), K ≥ 1 [rad or m]. Raises ExcitationError, which names what blocks."""
        unit = rng.uniform(-1.0, 1.0, (POSTURES, self.space.joint_count))
        unit[0] = 0.0
        postures = self.limits.middle + self.limits.half_range * unit
        rest = np.zeros_like(postures)
        parts = self.states.usages(MotionSamples(postures, rest, rest))
        possible = np.ones(POSTURES, dtype=bool)
        for part in parts:
            possible &= (part <= SETTLED).all(axis=1)
        if not possible.any():
            self._refuse(postures, parts)
        return postures[possible]

    def random_start(self, postures: Array, rng: np.random.Generator) -> Array | None:
        """A random series within all limits about one of `postures`, (K, n); None where none was found."""
        n = self.space.joint_count
        at_rest = np.zeros((n, self.space.columns))
        at_rest[:, 0] = (postures[rng.integers(len(postures))] - self.limits.middle) / self.limits.half_range
        shape = at_rest.copy()
        shape[:, 1:] = rng.normal(scale=10.0, size=(n, self.space.columns - 1))
        x = self.kinematics.fitted(shape, 1.0)
        x[:, 1:] *= rng.uniform(LEAST_HARMONIC, 1.0)
        x = self.kinematics.fitted(x, 1.0)
        if self.state_usage(x) <= SETTLED:
            return x
        # Where the centre had to move, the posture under it may be another: back to the one that is possible.
        x[:, 0] = at_rest[:, 0]
        room = 1.0 - np.abs(at_rest[:, 0])
        swing = x.copy()
        swing[:, 0] = 0.0
        reach = np.maximum(self.kinematics.largest(swing)[0], 1e-12)
        x[:, 1:] *= np.minimum(1.0, room / reach)[:, None]
        found = self.towards(at_rest, x)
        return found if np.abs(found[:, 1:]).max() > 1e-6 else None

    def repaired(self, x: Array, anchor: Array) -> Array:
        """A feasible vector near `x`: joint limits first, then towards `anchor`; both (n, columns)."""
        fitted = self.kinematics.fitted(x)
        return fitted if self.state_usage(fitted) <= SETTLED else self.towards(anchor, fitted)

    def towards(self, feasible: Array, wanted: Array) -> Array:
        """The farthest feasible point found from `feasible` straight to `wanted`; both (n, columns)."""
        low, high = 0.0, 1.0
        for _ in range(BISECTIONS):
            share = 0.5 * (low + high)
            if self.state_usage(feasible + share * (wanted - feasible)) <= SETTLED:
                low = share
            else:
                high = share
        return feasible + low * (wanted - feasible)

    def state_usage(self, x: Array) -> float:
        """Largest usage of torque and workspace of `x`, (n, columns), between the grid's instants too."""
        largest = 0.0
        for part in self.states.usages(self.grid.motion(x)) if self.states.parts else ():
            # Between samples a smooth function exceeds them by an eighth of its second difference.
            bend = np.abs(np.roll(part, -1, axis=0) - 2.0 * part + np.roll(part, 1, axis=0))
            largest = max(largest, float((part + bend / 8.0).max()))
        return largest

    def _refuse(self, postures: Array, parts: list[Array]) -> None:
        """Name the constraint that no posture keeps, or else those that no posture keeps together."""
        torque, workspace = self.states.torque, self.states.workspace
        if torque is not None:
            least = parts[0].min(axis=0)
            if least.max() > SETTLED:
                row, j = divmod(int(np.argmax(least)), self.robot.joint_count)
                joint, available = self.robot.joints[j], torque.bounds.available[row, j]
                unit, name = joint.type.torque_unit, torque.bounds.names[row]
                remedy = BOUNDS.get(name, "check the limit, the model and the margin")
                raise ExcitationError(
                    f"{joint.name}: {name} limit: at rest the prior model needs {least.max() * available:.4g} {unit} "
                    f"or more in every posture, {available:.4g} {unit} may be used; {remedy}"
                )
        if workspace is not None:
            worst = workspace.clearance(postures).max(axis=0)
            blocked = int(np.argmin(worst))
            if worst[blocked] < 0.0:
                raise ExcitationError(
                    f"workspace: {workspace.names[blocked]} meet in every posture, by {-worst[blocked]:.3g} m or more; "
                    "lower the floor or move the box"
                )
        kinds = ["the position limits"]
        kinds += ["the torque limits"] if torque is not None else []
        kinds += ["the workspace"] if workspace is not None else []
        names = " and ".join(filter(None, [", ".join(kinds[:-1]), kinds[-1]]))
        raise ExcitationError(f"none of {len(postures)} random postures keeps {names} at once; relax one of them")


def require_room(robot: Robot, limits: MotionLimits) -> None:
    """Refuse limits of a joint that leave no motion. Raises ExcitationError naming the joint and the limit."""
    for j, joint in enumerate(robot.joints):
        unit = joint.type.unit
        low, high = limits.position_low[j], limits.position_high[j]
        if not 0.5 * (high - low) >= LEAST_HALF_RANGE:
            raise ExcitationError(
                f"{joint.name}: position limits {low:.6g} to {high:.6g} {unit} leave no room to move; widen them"
            )
        for value, what, per in (
            (limits.velocity[j], "a velocity", "/s"),
            (limits.acceleration[j], "an acceleration", "/s²"),
        ):
            if not value > 0.0:
                raise ExcitationError(
                    f"{joint.name}: {what} limit of {value:.6g} {unit}{per} allows no motion; raise it"
                )
