"""Contact with the surroundings for a while: the tool presses with a force, or something acts on one joint."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tauscope.dynamics import gravity_torque
from tauscope.effects.context import ArmContext, Signals
from tauscope.effects.effect import Coefficient, Effect, Entry, Shape, Sizes, size_text
from tauscope.effects.time_local import EVERY, HALF_SINE, TimeLocalEffect
from tauscope.recording.recording import Array
from tauscope.robot import Robot
from tauscope.robot.robot import STANDARD_PARAMETERS

LENGTHS_S = (0.5, 1.5, 4.5)  # lengths of the windows looked through [s]
OVERLAP = 0.4  # part of a window that its neighbour covers too
_WINDOW = (
    Shape("scope", "1", fixed=True, reported=False),
    Shape("t_0", "s"),
    Shape("t_1", "s"),
    Shape("profile", "1", fixed=True, reported=False),
)


class ExternalContact(TimeLocalEffect):
    """τ = J(q)ᵀ F w(t), F at the origin of the last link's frame in base axes."""

    of_motion_alone = True
    id = "external_contact"
    rank = 220
    arguments = frozenset({"time"})
    equation = "tau = J(q)^T F w(t), or tau_j = c w(t); w = 1 or a half sine from t_0 to t_1"
    meaning = "the arm touches something for a while"
    remedy = "clear what it touches, or leave that stretch of the recording out"
    no_scenario = "a scenario starts anew each time, so only contact at the same time in every recording fits"
    revealing_motion = "the same motion once more without contact"
    coefficients = (Coefficient("F_x", "N"), Coefficient("F_y", "N"), Coefficient("F_z", "N"))
    shapes = _WINDOW

    @classmethod
    def forms(cls, context: ArmContext) -> Sequence[Effect]:
        """A force at the tool, and a torque at every joint."""
        grid, bounds = contact_windows(context.durations)
        if not len(grid):
            return []
        return [cls(None, grid, *bounds), *(JointContact(joint, grid, *bounds) for joint in context.joints)]

    def claim(self, found: Sizes, context: ArmContext) -> str:
        force = replace(
            found["F_x"], value=float(np.linalg.norm([found[name].value for name in ("F_x", "F_y", "F_z")]))
        )
        return f"a force of {size_text(force)} acts on the tool"

    def torque(self, signals: Signals, shape: Array) -> Array:
        """J(q)ᵀ, (3, n, N)."""
        return signals.remembered_of_motion("transposed Jacobian", lambda: transposed_jacobian(signals))

    def scenario_entries(self, coefficients: Sequence[float], shape: Sequence[float], robot: Robot) -> Sequence[Entry]:
        """A window that lies in every recording: a scenario starts anew each time."""
        if shape[0] != EVERY:
            return []
        profile = "half_sine" if shape[3] == HALF_SINE else "rectangular"
        window = {"start": max(shape[1], 0.0), "duration": shape[2] - shape[1], "profile": profile}
        own = {"force": list(coefficients)} if self.joint is None else {"torque": coefficients[0]}
        return [{**own, **window}]


class JointContact(ExternalContact):
    """τ_j = c w(t): the same at one joint alone."""

    is_variant = True
    coefficients = (Coefficient("c", "{tau}"),)

    def claim(self, found: Sizes, context: ArmContext) -> str:
        sign = "+" if found["c"].value >= 0.0 else "-"
        return f"an outside torque of {sign}{size_text(found['c'])} acts"

    def torque(self, signals: Signals, shape: Array) -> Array:
        """One, (1, 1, N)."""
        return np.ones((1, 1, signals.position.shape[1]))


def transposed_jacobian(signals: Signals) -> Array:
    """J(q)ᵀ of the last link's origin, base axes, (3, n, N): torque that holds it against a unit force.

    It is the torque that a unit mass there would ask for in a gravity of one unit along -x, -y, -z.
    """
    robot = signals.robot
    unit_mass = np.zeros(len(STANDARD_PARAMETERS) * robot.link_count)
    unit_mass[-len(STANDARD_PARAMETERS) + STANDARD_PARAMETERS.index("m")] = 1.0
    position = np.ascontiguousarray(signals.position.T)
    rows = [gravity_torque(replace(robot, gravity=-axis), unit_mass, position).T for axis in np.eye(3)]
    return np.stack(rows)


def contact_windows(durations: Sequence[float]) -> tuple[Array, tuple[Array, Array]]:
    """Windows of one recording each, and at the same instants of all, with the bounds of their shapes."""
    scopes = [(float(place), length) for place, length in enumerate(durations)]
    if len(durations) > 1:
        scopes.append((EVERY, min(durations)))
    rows = []
    for scope, whole in scopes:
        for length in LENGTHS_S:
            starts = np.arange(0.0, whole - length, (1.0 - OVERLAP) * length)
            rows += [(scope, start, start + length, profile) for start in starts for profile in (0.0, HALF_SINE)]
    longest = max(durations)
    lower = np.array([EVERY, 0.0, 0.0, 0.0])
    upper = np.array([len(durations) - 1.0, longest, longest, 1.0])
    return np.array(rows).reshape(-1, 4), (lower, upper)
