"""The identification as a document: what ``identify --json`` writes and the REST API returns (CONTRACT.md)."""

from typing import Any, ClassVar, Literal

import numpy as np
from pydantic import Field, model_validator

from tauscope.identification.friction_shape import shape_parameters
from tauscope.identification.identification import Identification
from tauscope.identification.posterior import DETERMINED
from tauscope.identification.residuals import Fit
from tauscope.identification.warnings import identification_warnings, weak_points
from tauscope.recording.conditioning import ConditioningEntry
from tauscope.result_warning import ResultWarning
from tauscope.robot import STANDARD_PARAMETERS
from tauscope.robot.robot_data import link_to_dict
from tauscope.strict_model import ResultModel, take_fields


class Entry(ResultModel):
    """A part of the document; keys that earlier versions wrote and this one does not are passed over."""

    retired: ClassVar[frozenset[str]] = frozenset()

    @model_validator(mode="before")
    @classmethod
    def _pass_over(cls, data: Any) -> Any:
        return {key: data[key] for key in data if key not in cls.retired} if isinstance(data, dict) else data


class BaseParameterEntry(Entry):
    """One identifiable combination of the links' standard parameters."""

    retired = frozenset({"free_value"})

    name: str = Field(description="readable expression, e.g. Ixx2 - Iyy2 - 0.5*msx2")
    terms: dict[str, float] = Field(description="coefficient of every standard parameter in it, to full precision")
    value: float = Field(description="estimate [kg m², kg m or kg, by its terms]")
    std: float | None = Field(description="standard error; null where nothing is known of it")
    independent: bool = Field(description="whether it is one standard parameter by itself")
    determined_by: Literal["data", "prior", "both"] | None = Field(
        default=None, description="data took at least nine tenths of the prior's variance, at most a tenth, or between"
    )


class FrictionEntry(ResultModel):
    """Friction of one joint: τ_s A(K_v q̇) + τ_sc A(δ q̇) + τ_v q̇ + offset, A(x) = (2/π) atan x."""

    joint: str = Field(description="name of the joint")
    stiction: float = Field(description="τ_s [Nm or N]")
    stribeck: float = Field(description="τ_sc [Nm or N]; 0 where the data show no such term")
    viscous: float = Field(description="τ_v [Nm s/rad or N s/m]")
    offset: float = Field(description="constant torque [Nm or N]")
    k_v: float = Field(description="K_v [s/rad or s/m]")
    delta: float | None = Field(description="δ [s/rad or s/m]; null where the data show no Stribeck term")
    std: dict[str, float | None] = Field(
        description="standard errors of the entries that were estimated; null where the recordings are silent"
    )
    identifiable: dict[str, bool] = Field(description="false for an entry that these data cannot tell")


class RotorEntry(ResultModel):
    """Reflected rotor inertia of one joint, where the data ask for it."""

    joint: str = Field(description="name of the joint")
    value: float = Field(description="I_a [kg m² or kg]")
    std: float | None = Field(description="standard error; null where the recordings are silent")


class InertiaEntry(ResultModel):
    """Inertia about the link frame's origin [kg m²]."""

    xx: float = Field(description="Ixx")
    yy: float = Field(description="Iyy")
    zz: float = Field(description="Izz")
    xy: float = Field(description="Ixy")
    xz: float = Field(description="Ixz")
    yz: float = Field(description="Iyz")


class LinkEntry(ResultModel):
    """One link of the most probable bodies, in its link frame."""

    mass: float = Field(description="m [kg]")
    first_moment: list[float] = Field(description="m s [kg m]")
    inertia: InertiaEntry = Field(description="about the link frame's origin")


class FitEntry(ResultModel):
    """How well the model explains some recordings."""

    rms: list[float] = Field(description="per joint, residual at the recorded rate, unfiltered [Nm or N]")
    band_rms: list[float] = Field(description="per joint, residual in the common band [Nm or N]")
    relative_error: float = Field(description="‖τ - τ̂‖ / ‖τ‖ over all joints, in the common band")
    predicted_rms: list[float] | None = Field(
        default=None, description="per joint, the `rms` that noise and the covariance of the parameters lead to expect"
    )


class FitsEntry(Entry):
    """How well the model explains what it was made from, and what was held out."""

    retired = frozenset({"links_train", "links_held_out"})

    train: FitEntry = Field(description="on the recordings that the model was made from")
    held_out: FitEntry | None = Field(default=None, description="on recordings that were not used")
    price_of_bodies: list[float] | None = Field(
        default=None,
        description="per joint, training residual with bodies over that of the free least-squares estimate",
    )


class JointExcitationEntry(ResultModel):
    """How one joint moves, and what of it that does not tell."""

    joint: str = Field(description="name of the joint")
    range: list[float] = Field(description="lowest and highest position [rad or m]")
    speed: float = Field(description="top speed, which one sample in a hundred exceeds [rad/s or m/s]")
    reversals: int = Field(description="how often it turns round")
    weak: list[str] = Field(description="what the recordings hardly tell, each with the motion that would")


class ExcitationEntry(ResultModel):
    """What the recordings excite."""

    joints: list[JointExcitationEntry] = Field(description="one a joint")
    extrapolation: list[float] | None = Field(
        default=None,
        description="per joint, share of the held-out torque that training leaves uncertain; null without any",
    )


class IdentificationDocument(ResultModel):
    """Result of an identification, schema tauscope.identification/1."""

    schema_id: Literal["tauscope.identification/1"] = Field(
        default="tauscope.identification/1", alias="schema", description="name and version of this document's form"
    )
    warnings: list[ResultWarning] = Field(default=[], description="what to know before the numbers, the gravest first")
    robot: str = Field(description="name of the robot")
    joints: list[str] = Field(description="names of its joints, in chain order")
    estimator: Literal["ls", "wls"] = Field(description="how the joints' equations were weighted")
    prior: bool = Field(
        default=True, description="true where the most probable bodies are delivered; false: the free estimate"
    )
    constrained: bool = Field(
        description="true where no rigid bodies can have the free estimate, beyond what noise explains"
    )
    cutoff_hz: float | None = Field(
        description="band shared by torque and regressor [Hz]; null where nothing was filtered"
    )
    noise_std: list[float] = Field(description="per joint, torque noise a sample [Nm or N]")
    noise_method: Literal["periods", "residual"] = Field(
        description="from differences between repeated periods (model-free), or from the whitened residual"
    )
    condition_number: float = Field(description="of the stacked, unweighted regressor")
    base_parameters: list[BaseParameterEntry] = Field(description="what torque and position can tell of the links")
    unidentifiable: list[str] = Field(description="standard parameters that no motion of this arm shows")
    undetermined: list[str] = Field(description="parameters that these recordings, unlike others, say nothing about")
    friction: list[FrictionEntry] = Field(description="one a joint")
    rotor_inertia: list[RotorEntry] = Field(description="joints whose rotor the data ask for")
    links: list[LinkEntry] = Field(description="most probable full parameter set; the base parameters are its own")
    links_friction: list[FrictionEntry] = Field(description="friction that belongs to `links`")
    fit: FitsEntry = Field(description="how well it explains the torque")
    excitation: ExcitationEntry | None = Field(default=None, description="what the recordings excite")
    conditioning: list[ConditioningEntry] = Field(description="one a recording used")
    held_out_conditioning: list[ConditioningEntry] = Field(description="one a held-out recording")


_COEFFICIENTS = ("stiction", "stribeck", "viscous", "offset")


def document(identification: Identification) -> IdentificationDocument:
    """The document of an identification."""
    result = identification
    names = [f"{name}{link + 1}" for link in range(result.robot.link_count) for name in STANDARD_PARAMETERS]
    return take_fields(
        IdentificationDocument,
        result,
        warnings=identification_warnings(result),
        robot=result.robot.name,
        joints=[joint.name for joint in result.robot.joints],
        estimator=result.options.estimator.value,
        prior=result.options.prior,
        noise_std=result.residuals.noise_std.tolist(),
        noise_method="periods" if result.residuals.noise_method == "periods" else "residual",
        base_parameters=_base_parameters(result),
        unidentifiable=[names[column] for column in result.structure.base.unidentifiable_columns],
        undetermined=[name for name, open_ in zip(result.structure.names, result.undetermined, strict=True) if open_],
        friction=_friction(result, result.parameters),
        rotor_inertia=_rotors(result),
        links=[LinkEntry.model_validate(link_to_dict(link)) for link in result.consistent.links],
        links_friction=_friction(result, result.consistent_parameters),
        fit=FitsEntry(
            train=_fit(result.residuals.fit, result.predicted_train),
            held_out=None if result.held_out is None else _fit(result.held_out, result.predicted_held_out),
            price_of_bodies=result.price_of_bodies.tolist(),
        ),
        excitation=_excitation(result),
    )


def _std(result: Identification) -> list[float | None]:
    errors: list[float | None] = np.sqrt(np.maximum(np.diag(result.covariance), 0.0)).tolist()
    believed = result.structure.base_count if result.options.prior else 0
    for column in np.flatnonzero(result.undetermined):
        errors[column] = errors[column] if column < believed else None
    return errors


def _base_parameters(result: Identification) -> list[BaseParameterEntry]:
    base, std, learnt = result.structure.base, _std(result), result.posterior.learnt
    return [
        BaseParameterEntry(
            name=base.expressions[place],
            terms=dict(base.terms[place]),
            value=float(result.parameters[place]),
            std=std[place],
            independent=bool(base.is_independent(place)),
            determined_by="data" if taken >= DETERMINED else "prior" if taken <= 1.0 - DETERMINED else "both",
        )
        for place, taken in enumerate(learnt[: result.structure.base_count])
    ]


def _friction(result: Identification, parameters: np.ndarray) -> list[FrictionEntry]:
    """One entry a joint; coefficients that the model lacks are zero and have no standard error."""
    std = _std(result)
    shape_std = dict(zip(shape_parameters(result.shapes), std[result.structure.size :], strict=True))
    entries = []
    for joint, (shape, known) in enumerate(zip(result.shapes, result.identifiable, strict=True)):
        columns = {name: result.structure.coefficient(joint, name) for name in _COEFFICIENTS}
        present = {name: column for name, column in columns.items() if column is not None}
        errors = {name: std[column] for name, column in present.items()}
        for name, value in (("k_v", shape.k_v), ("delta", shape.delta)):
            if value is not None and (joint, name) in shape_std:
                errors[name] = value * (shape_std[joint, name] or 0.0)
        values = {name: float(parameters[present[name]]) if name in present else 0.0 for name in columns}
        told = {name: known[name] for name in (*_COEFFICIENTS, "k_v", "delta")}
        shapes = {"k_v": shape.k_v, "delta": shape.delta}
        name = result.robot.joints[joint].name
        entries.append(FrictionEntry(joint=name, **values, **shapes, std=errors, identifiable=told))
    return entries


def _rotors(result: Identification) -> list[RotorEntry]:
    std = _std(result)
    return [
        RotorEntry(joint=result.robot.joints[joint].name, value=float(result.parameters[column]), std=std[column])
        for joint, column in result.structure.coefficients("rotor_inertia").items()
    ]


def _fit(fit: Fit, predicted: np.ndarray | None = None) -> FitEntry:
    return take_fields(FitEntry, fit, predicted_rms=None if predicted is None else predicted.tolist())


def _excitation(result: Identification) -> ExcitationEntry:
    found = result.excitation
    joints = [
        JointExcitationEntry(
            joint=each.name,
            range=[float(found.lowest[joint]), float(found.highest[joint])],
            speed=float(found.speed[joint]),
            reversals=int(found.reversals[joint]),
            weak=weak_points(result, joint),
        )
        for joint, each in enumerate(result.robot.joints)
    ]
    return take_fields(ExcitationEntry, result, joints=joints)
