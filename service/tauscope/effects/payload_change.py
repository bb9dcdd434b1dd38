"""Mass picked up or dropped while it was recorded, or between two recordings."""

from collections.abc import Sequence

import numpy as np

from tauscope.effects.carried_body import FARTHEST_M, MASS, PLACE, body_columns, body_quantities, unit_body
from tauscope.effects.context import ArmContext, Signals
from tauscope.effects.effect import Effect, Entry, Quantities, Quantity, Shape, Sizes, size_text
from tauscope.effects.time_local import EVERY, OUTSIDE, TimeLocalEffect, since
from tauscope.recording.recording import Array
from tauscope.robot import Robot

NEAR_EDGE = 0.03  # part of a recording within which an edge of a window is the recording's own
INSTANTS = 12  # instants of every recording at which the payload may change


class PayloadChange(TimeLocalEffect):
    """τ = m Φ_body(r) w(t), Φ_body the torque of a point mass at r of the last link."""

    of_motion_alone = True
    id = "payload_change"
    rank = 210
    arguments = frozenset({"position", "velocity", "acceleration", "others", "time"})
    equation = "tau = m Phi_body(q, qd, qdd; r) w(t), w = 1 from t_on to t_off"
    meaning = "a mass at the tool is picked up or dropped"
    remedy = "record with one payload at a time, or add the body to the last link while it is carried"
    no_scenario = "a scenario starts anew each time, so only a load at the same time in every recording fits"
    revealing_motion = "the same motion without payload, and once more with it all the time"
    coefficients = (MASS,)
    shapes = (
        Shape("scope", "1", fixed=True, reported=False),
        Shape("t_on", "s"),
        Shape("t_off", "s"),
        Shape("profile", "1", fixed=True, reported=False),
        *PLACE,
    )

    @classmethod
    def forms(cls, context: ArmContext) -> Sequence[Effect]:
        grid = payload_windows(context.durations)
        longest = max(context.durations)
        lower = np.array([since(len(context.durations) - 1), 0.0, 0.0, OUTSIDE, *(-FARTHEST_M,) * 3])
        upper = np.array([len(context.durations) - 1.0, longest, 1.1 * longest, 0.0, *(FARTHEST_M,) * 3])
        return [cls(None, grid, lower, upper)] if len(grid) else []

    def twins(self, shape: Array, recordings: int) -> list[tuple[float, Array]]:
        """Also a load outside the window of `shape`, (k,), where one is missing within it."""
        found = super().twins(shape, recordings)
        if self.is_shared(shape):
            return found
        other = shape.copy()
        other[3] = 0.0 if shape[3] == OUTSIDE else OUTSIDE
        return [*found, (-1.0, other)]

    def torque(self, signals: Signals, shape: Array) -> Array:
        """Torque of one kilogramme at r, (1, n, N)."""
        return np.tensordot(unit_body(shape[4:]), body_columns(signals), axes=1)[None]

    def quantities(self, context: ArmContext, coefficients: Array, shape: Array, covariance: Array) -> Quantities:
        body = (0, 5, 6, 7)
        sign, instants = carried(float(coefficients[0]), shape, context.durations)
        found = list(body_quantities(sign * float(coefficients[0]), shape[4:], covariance[np.ix_(body, body)]))
        std = np.sqrt(np.maximum(np.diag(covariance), 0.0))
        found += [Quantity(name, float(shape[place]), float(std[1 + place]), "s") for name, place in instants.items()]
        return tuple(found)

    def claim(self, found: Sizes, context: ArmContext) -> str:
        return f"a {size_text(found['m'])} mass"

    def when(self, coefficients: Array, shape: Array, names: Sequence[str], durations: Sequence[float]) -> str:
        recording = int(-2 - shape[0])
        if shape[0] < EVERY and shape[1] > (1.0 - NEAR_EDGE) * durations[recording]:
            verb = "is carried" if coefficients[0] > 0.0 else "is missing"
            return f"{verb} from {names[recording + 1]} on"
        _, instants = carried(float(coefficients[0]), shape, durations)
        verbs = {"t_on": "is picked up", "t_off": "is dropped"}
        said = [f"{verbs[name]} at {shape[place]:.2f} s" for name, place in instants.items()]
        where = self.recording_words(shape, names)
        return f"{' and '.join(said)} of {where}" if said else f"is carried in {where}"

    def scenario_entries(self, coefficients: Sequence[float], shape: Sequence[float], robot: Robot) -> Sequence[Entry]:
        """A load that is carried in every recording: a scenario starts anew each time."""
        if shape[0] != EVERY or coefficients[0] <= 0.0:
            return []
        return [{"mass": coefficients[0], "offset": list(shape[4:7]), "start": shape[1], "end": shape[2]}]


def carried(mass: float, shape: Array, durations: Sequence[float]) -> tuple[float, dict[str, int]]:
    """The sign that makes the mass positive, and which of the window's edges are its being picked up and dropped.

    Beside a nominal model that has it or not, a mass that is missing in one part is a mass that is carried in the rest.
    `mass`: m [kg]; `shape`: (7,), the window; `durations`: of the recordings [s].
    """
    scope, start, end = shape[:3]
    if shape[3] == OUTSIDE:
        sign, edges = carried(-mass, np.array([scope, start, end, 0.0]), durations)
        return -sign, edges
    if scope < EVERY:
        return (1.0, {"t_on": 1}) if mass > 0.0 else (-1.0, {"t_off": 1})
    length = min(durations) if scope == EVERY else durations[int(scope)]
    from_begin, to_end = start < NEAR_EDGE * length, end > (1.0 - NEAR_EDGE) * length
    sign = -1.0 if mass < 0.0 and not (from_begin and to_end) else 1.0
    first, last = ("t_on", "t_off") if sign > 0.0 else ("t_off", "t_on")
    edges = {} if from_begin else {first: 1}
    return sign, edges if to_end else {**edges, last: 2}


def payload_windows(durations: Sequence[float]) -> Array:
    """Windows, (g, 7), of carrying, r = 0: within one recording, at the same instants of all, or from one on."""
    rows = []
    scopes = [(float(place), length) for place, length in enumerate(durations)]
    if len(durations) > 1:
        scopes.append((EVERY, min(durations)))
    for scope, whole in scopes:
        edges = np.linspace(0.0, whole, INSTANTS + 1)
        for first, start in enumerate(edges[:-1]):
            for end in edges[first + 2 :]:
                if not (scope == EVERY and start == 0.0 and end == edges[-1]):
                    beyond = 0.05 * whole if end == edges[-1] else 0.0
                    rows.append((scope, start, end + beyond, 0.0, 0.0, 0.0, 0.0))
    for place, whole in enumerate(durations[:-1]):
        for start in np.linspace(0.0, whole, INSTANTS + 1)[0 if place else 1 :]:
            rows.append((since(place), start, 0.0, 0.0, 0.0, 0.0, 0.0))
    return np.array(rows).reshape(-1, 7)
