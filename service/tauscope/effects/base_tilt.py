"""The direction of gravity in the base frame: a base that is not level."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tauscope.dynamics import torque_regressor
from tauscope.effects.context import ArmContext, Signals
from tauscope.effects.effect import Coefficient, Effect, Entry, Sizes, size_text
from tauscope.recording.recording import Array
from tauscope.robot import Robot
from tauscope.robot.robot import STANDARD_PARAMETERS


def tilt_directions(gravity: Array) -> tuple[Array, Array]:
    """Two unit vectors across gravity, (3,) in the base frame, the frame's axes where it lies along one."""
    axes = np.eye(3)
    main = int(np.argmax(np.abs(gravity)))
    unit = gravity / np.linalg.norm(gravity)
    others = [axes[axis] - (axes[axis] @ unit) * unit for axis in range(3) if axis != main]
    return others[0] / np.linalg.norm(others[0]), others[1] / np.linalg.norm(others[1])


class BaseTilt(Effect):
    """τ = ∂τ/∂g (|g| α_1 e_1 + |g| α_2 e_2), e_1 and e_2 across gravity."""

    id = "base_tilt"
    rank = 200
    arguments = frozenset({"position", "others"})
    equation = "tau = dtau/dg (|g| (alpha_1 e_1 + alpha_2 e_2)), e_1 and e_2 across gravity"
    meaning = "gravity points elsewhere in the base frame than the robot file says"
    remedy = "level the base, or correct gravity in the robot file"
    no_code = "it needs the positions of all joints"
    no_scenario = "a scenario tilts gravity along -z only"
    revealing_motion = "wide poses all round the first joint"
    coefficients = (Coefficient("alpha_1", "rad"), Coefficient("alpha_2", "rad"))

    @classmethod
    def forms(cls, context: ArmContext) -> Sequence[Effect]:
        """One for the arm, where there is gravity."""
        return [cls(None)] if np.linalg.norm(context.robot.gravity) > 0.0 else []

    def columns(self, signals: Signals, shapes: Array) -> Array:
        """Torque of gravity of the same strength across the stated one."""
        places = np.flatnonzero([_is_weighed(place) for place in range(len(signals.links))])
        regressors = signals.remembered_of_motion("tilt", lambda: _make_regressors(signals, places))
        return np.stack([signals.links[places] @ each for each in regressors])[None]

    def claim(self, found: Sizes, context: ArmContext) -> str:
        size = replace(found["alpha_1"], value=float(np.hypot(found["alpha_1"].value, found["alpha_2"].value)))
        return f"gravity in the base frame is off by {size_text(size)}"

    def scenario_entries(self, coefficients: Sequence[float], shape: Sequence[float], robot: Robot) -> Sequence[Entry]:
        """For gravity along -z: R_x(α) R_y(β) (0, 0, -g) is g (-β, α, -1) to first order."""
        if robot.gravity[2] >= 0.0 or np.abs(robot.gravity[:2]).max() > 0.0:
            return []
        return [{"about_x": coefficients[1], "about_y": -coefficients[0]}]


def _make_regressors(signals: Signals, places: NDArray[np.intp]) -> list[Array]:
    """Regressors at rest of some standard parameters, under gravity across the stated one, (n, C, N)."""
    robot, position = signals.robot, np.ascontiguousarray(signals.position.T)
    strength, rest = float(np.linalg.norm(robot.gravity)), np.zeros_like(position)
    tilted = (replace(robot, gravity=strength * each) for each in tilt_directions(robot.gravity))
    return [torque_regressor(each, position, rest, rest, columns=places).transpose(1, 2, 0) for each in tilted]


def _is_weighed(place: int) -> bool:
    """Whether a standard parameter is a mass or a first moment."""
    return STANDARD_PARAMETERS[place % len(STANDARD_PARAMETERS)] in ("m", "msx", "msy", "msz")
