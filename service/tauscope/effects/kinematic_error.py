"""A link frame that is not where the robot file has it: a wrong length.

The base parameters take nearly all of it: what is left of a few millimetres is often a ten-thousandth of its torque.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tauscope.dynamics import inverse_dynamics
from tauscope.effects.context import ArmContext, Signals
from tauscope.effects.effect import Coefficient, Effect, Entry, Shape, Sizes, size_text
from tauscope.recording.recording import Array
from tauscope.robot import Placement, Robot

# Displacement of a frame for the difference quotient [m]; torque is quadratic in it, on the scale of the arm.
STEP_M = 1e-5
LARGEST_M = 0.2  # a frame farther off is no error of measurement [m]


class KinematicError(Effect):
    """τ = ∂τ/∂d d: the frame of one link lies d farther along one axis, of those before its last turn."""

    id = "kinematic_error"
    rank = 230
    arguments = frozenset({"position", "velocity", "acceleration", "others"})
    equation = "tau = dtau/dd d, d the displacement of one link's frame along one of its axes"
    meaning = "a link length or frame is wrong"
    remedy = "measure the arm's geometry, and correct the robot file by d"
    no_code = "it needs the positions of all joints"
    revealing_motion = "none: measure the tool's place in several postures instead"
    coefficients = (Coefficient("d", "m", largest=LARGEST_M),)
    shapes = (Shape("link", "1", fixed=True), Shape("axis", "1", fixed=True))

    @classmethod
    def forms(cls, context: ArmContext) -> Sequence[Effect]:
        """One for the arm; its shapes are links and axes, without the last link: its load hangs at its own frame."""
        links = np.arange(1.0, context.robot.link_count)
        grid = np.stack(np.meshgrid(links, np.arange(1.0, 4.0), indexing="ij"), axis=-1).reshape(-1, 2)
        return [cls(None, grid, grid[0], grid[-1])] if len(grid) else []

    def columns(self, signals: Signals, shapes: Array) -> Array:
        """Torque per metre, (g, 1, n, N)."""
        exact, *longer = _torques(signals, [(shapes[0], 0.0), *((shape, STEP_M) for shape in shapes)])
        return np.stack([(each - exact) / STEP_M for each in longer])[:, None]

    def torque_of(self, signals: Signals, coefficients: Array, shape: Array) -> Array:
        """Torque of the arm as it is less that of the arm as the file has it, (n, N)."""
        longer, exact = _torques(signals, [(shape, float(coefficients[0])), (shape, 0.0)])
        return longer - exact

    def claim(self, found: Sizes, context: ArmContext) -> str:
        link, axis = int(found["link"].value), "xyz"[int(found["axis"].value) - 1]
        sign = "+" if found["d"].value >= 0.0 else "-"
        return f"the frame of link {link} is off by {size_text(found['d'])} along {sign}{axis}"

    def scenario_entries(self, coefficients: Sequence[float], shape: Sequence[float], robot: Robot) -> Sequence[Entry]:
        link, axis = (int(each) for each in shape)
        return [{"link": link, "translation": [coefficients[0] if each == axis else 0.0 for each in (1, 2, 3)]}]


def _torques(signals: Signals, displacements: Sequence[tuple[Array, float]]) -> list[Array]:
    """Rigid-body torque (n, N) with one link's frame displaced along one of its axes, for each shape and length."""
    state = [np.ascontiguousarray(each.T) for each in (signals.position, signals.velocity, signals.acceleration)]
    found = []
    for shape, by in displacements:
        link, axis = (int(each) - 1 for each in shape)
        arm = displaced(signals.robot, link, by * np.eye(3)[axis])
        found.append(inverse_dynamics(arm, signals.links, *state).T)
    return found


def displaced(robot: Robot, link: int, by: Array) -> Robot:
    """The arm with the frame of one link, and all that follows, displaced `by` (3,), in the moved frame [m]."""
    segment = robot.segments[link]
    after = Placement(segment.after.rotation, segment.after.translation + by)
    segments = (*robot.segments[:link], replace(segment, after=after), *robot.segments[link + 1 :])
    return replace(robot, segments=segments)
