"""The parameters that a refinement moves, with their priors, and the model that they make."""

from dataclasses import dataclass, replace

import numpy as np

from tauscope.closed_loop.batch import Variants, simulate_segments
from tauscope.closed_loop.drive import LOST
from tauscope.closed_loop.laws import LoadFriction
from tauscope.closed_loop.segments import Segments
from tauscope.dynamics import mass_matrix
from tauscope.export.model import ExportModel
from tauscope.recording.recording import Array
from tauscope.robot import Actuator, LinkInertia
from tauscope.robot.actuator import ROOM_C

# Standard error of masses relative to themselves, and of centres of mass relative to the arm of their inertia.
BODY_STD = 0.1
GYRATION_STD = 0.3  # relative standard error of radii of gyration about centres of mass: torque tells them last of all
# Loss of torque per volt with temperature, prior [1/K]: copper 0.4 %/K, magnets 0.2 %/K; the sensor is not at both.
WARM_LOSS, WARM_LOSS_STD = 0.006, 0.01
STEP = 0.3  # size of a step of friction relative to its level
PER_BODY, PER_JOINT = 5, 5


@dataclass(frozen=True)
class Term:
    """One parameter. `start`, `prior_std`: mean and standard error of its prior; infinite without one."""

    name: str
    unit: str
    start: float
    scale: float  # of its steps
    prior_std: float = np.inf
    least: float = -np.inf  # lower bound
    is_optional: bool = False  # whether a model does without it: zero then


class RefinableModel:
    """A model as a function of P parameters, and its errors on segments."""

    def __init__(self, model: ExportModel, loops: tuple[Actuator, ...], segments: Segments) -> None:
        self.segments = segments
        self._model = model
        self._loops = loops
        self._links = np.array([link.to_vector() for link in model.links])
        self._bodies = [place for place, link in enumerate(self._links) if link[6] > 0.0]
        self._rotor = np.array([value or 0.0 for value in model.rotor_inertia])
        is_open = any(loop.unit == "register" for loop in loops) and not any(loop.temperature_slope for loop in loops)
        self._is_warmed = segments.warmth is not None and is_open
        loss = Term("loss of torque per volt", "1/K", WARM_LOSS, WARM_LOSS_STD, WARM_LOSS_STD)
        self.terms = (*self._body_terms(), *self._friction_terms(), *([loss] if self._is_warmed else []))

    def _body_terms(self) -> list[Term]:
        robot = self._model.robot
        total = sum(self._links[place, 6] for place in self._bodies)
        inertia = np.diag(mass_matrix(robot, self._links.ravel(), np.zeros((1, robot.joint_count)))[0])
        reach = float(np.sqrt(inertia.max() / total)) if total > 0.0 else 1.0
        terms = []
        for place in self._bodies:
            mass, name = float(self._links[place, 6]), f"link {place + 1}"
            terms.append(Term(f"mass of {name}", "kg", mass, BODY_STD * mass, BODY_STD * mass, 1e-3 * mass))
            for axis, centre in zip("xyz", self._links[place, 7:] / mass, strict=True):
                text = f"centre of mass {axis} of {name}"
                terms.append(Term(text, "m", float(centre), BODY_STD * reach, BODY_STD * reach))
            terms.append(Term(f"relative gyration of {name}", "1", 1.0, BODY_STD, GYRATION_STD, BODY_STD))
        return terms

    def _friction_terms(self) -> list[Term]:
        """Friction of each joint; a constant torque has no cause but a spring, and is as large as dry friction."""
        terms = []
        for joint, law in zip(self._model.robot.joints, self._model.friction, strict=True):
            unit = joint.type.torque_unit
            level, damping = max(law.stiction + min(law.stribeck, 0.0), 1e-6), max(law.viscous, 1e-6)
            terms += [
                Term(f"stiction {joint.name}", unit, law.stiction, STEP * level, least=0.0),
                Term(f"viscous {joint.name}", f"{unit} s/{joint.type.unit}", law.viscous, STEP * damping, least=0.0),
                Term(f"offset {joint.name}", unit, 0.0, STEP * level, level),
                Term(f"driving friction {joint.name}", f"1/{unit}", 0.0, STEP, least=0.0, is_optional=True),
                Term(f"braking friction {joint.name}", "1", 0.0, STEP, least=0.0, is_optional=True),
            ]
        return terms

    def clip(self, values: Array) -> Array:
        """Parameters within their bounds. `values`: (..., P). Returns (..., P)."""
        return np.maximum(values, [term.least for term in self.terms])

    def errors(self, values: Array) -> Array:
        """Position errors on the segments. `values`: (V, P). Returns (K, n, S, V) [rad or m]."""
        with np.errstate(all="ignore"):  # models that no arm can have may fly off
            found = simulate_segments(self._model.robot, self._loops, self.segments, self._variants(values))
        return np.nan_to_num(np.clip(found - self.segments.position[..., None], -LOST, LOST), nan=LOST)

    def _variants(self, values: Array) -> Variants:
        number, joints, law = len(values), len(self._rotor), self._model.friction
        bodies = PER_BODY * len(self._bodies)
        links = np.repeat(self._links[None], number, axis=0)
        for body, place in enumerate(self._bodies):
            links[:, place] = _move_body(self._links[place], values[:, PER_BODY * body : PER_BODY * (body + 1)])
        own = values[:, bodies : bodies + PER_JOINT * joints].reshape(number, joints, PER_JOINT)
        return Variants(
            links=links.reshape(number, -1),
            rotor=np.repeat(self._rotor[None], number, axis=0),
            stiction=own[..., 0],
            viscous=own[..., 1],
            offset=own[..., 2],
            stribeck=np.array([each.stribeck for each in law]),
            delta=np.array([each.delta or 0.0 for each in law]),
            driving=own[..., 3],
            braking=own[..., 4],
            slope=values[:, -1] if self._is_warmed else np.zeros(number),
        )

    def model_of(self, values: Array) -> tuple[ExportModel, LoadFriction, tuple[Actuator, ...]]:
        """The model of parameters, its friction by load, and its loops. `values`: (P,)."""
        found = self._variants(values[None])
        friction = tuple(
            replace(law, stiction=float(stiction), viscous=float(viscous), offset=float(offset))
            for law, stiction, viscous, offset in zip(
                self._model.friction, found.stiction[0], found.viscous[0], found.offset[0], strict=True
            )
        )
        links = tuple(LinkInertia.from_vector(link) for link in found.links[0].reshape(-1, 10))
        model = replace(self._model, links=links, friction=friction, delivered_friction=friction)
        loops = tuple(self._warm(loop, float(found.slope[0])) for loop in self._loops)
        return model, LoadFriction(found.driving[0], found.braking[0]), loops

    def _warm(self, loop: Actuator, slope: float) -> Actuator:
        mean = self.segments.mean_temperature
        if not self._is_warmed or mean is None or loop.unit != "register":
            return loop
        at_room = (loop.volt_torque or 0.0) * (1.0 + slope * (mean - ROOM_C))
        return replace(loop, temperature_slope=slope, torque_per_volt=at_room)


def _move_body(link: Array, body: Array) -> Array:
    """Standard parameters (V, 10) of a body with another mass, centre (3) and relative gyration, (V, 5)."""
    mass, centre, gyration = body[:, 0], body[:, 1:4], body[:, 4]
    xx, yy, zz, xy, xz, yz = link[:6]
    about = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) / link[6]
    at = link[7:] / link[6]
    central = about - (at @ at * np.eye(3) - np.outer(at, at))
    square = np.einsum("vi,vi->v", centre, centre)[:, None, None] * np.eye(3) - np.einsum("vi,vj->vij", centre, centre)
    moved = mass[:, None, None] * (gyration[:, None, None] ** 2 * central + square)
    moments = [moved[:, row, column] for row, column in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
    return np.column_stack([*moments, mass, mass[:, None] * centre])
