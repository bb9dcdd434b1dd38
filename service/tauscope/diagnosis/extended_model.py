"""An extended model as a document, schema tauscope.model/1, and back: every number reads as the same float64."""

from collections.abc import Mapping
from dataclasses import fields
from inspect import isabstract
from typing import Any, Literal

import numpy as np
from pydantic import Field

from tauscope.diagnosis.findings.diagnosed import Diagnosis
from tauscope.diagnosis.model.extended import ExtendedModel
from tauscope.diagnosis.model.term import Term
from tauscope.dynamics import base_parameters
from tauscope.effects import Effect, catalogue
from tauscope.errors import IdentificationError
from tauscope.identification.consistency import plausible_prior
from tauscope.identification.full_parameters import FullParameters
from tauscope.identification.physical_estimate import consistent_estimate
from tauscope.identification.posterior import WIDE
from tauscope.identification.structure import JointTerms, ModelStructure
from tauscope.robot import LinkInertia, Robot
from tauscope.robot.messages import shown
from tauscope.strict_model import ResultModel

SMALLEST = 1e-12  # eigenvalues of the scaled covariance below this share of the largest are no direction


def consistent_links(diagnosis: Diagnosis) -> tuple[LinkInertia, ...]:
    """The nearest physically consistent links to the final model, in the metric of its covariance."""
    fit = diagnosis.selection.fit
    structure, size = fit.model.structure, fit.model.structure.size
    covariance = fit.covariance[:size, :size] * diagnosis.inflation
    scale = np.sqrt(np.maximum(np.diag(covariance), np.finfo(float).tiny))
    values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    known = values > SMALLEST * values[-1]
    factor = (vectors[:, known] / np.sqrt(values[known])).T / scale
    target = factor @ fit.model.parameters
    full = FullParameters.of(structure)
    prior = plausible_prior(structure.robot, factor @ full.map, target, full.friction).widen(WIDE)
    return consistent_estimate(structure, factor, target, prior).links


LARGEST_FILE = 16 * 2**20
PLACES = ("joint", "grid", "lower", "upper")  # fields of every effect; any others are settings of its own


class NamedValue(ResultModel):
    """A number with its name."""

    name: str = Field(description="in the equation, or of the base parameter in full")
    value: float = Field(description="SI")


class JointFrictionEntry(ResultModel):
    """Nominal terms of one joint, in the units of identify's result."""

    joint: str = Field(description="name of the joint")
    stiction: float = Field(description="τ_s [Nm or N]")
    stribeck: float | None = Field(description="τ_sc [Nm or N]; null where the joint has no such term")
    viscous: float = Field(description="τ_v [Nm s/rad or N s/m]")
    offset: float = Field(description="constant [Nm or N]")
    k_v: float = Field(description="slope of the smooth sign [s/rad or s/m]")
    delta: float | None = Field(description="slope of the Stribeck term [s/rad or s/m]")


class EffectEntry(ResultModel):
    """One effect beside the nominal model."""

    effect: str = Field(description="id of the effect")
    form: str = Field(description="which of its forms")
    joint: str | None = Field(description="name of the joint; null where it belongs to the whole arm")
    equation: str = Field(description="its torque")
    settings: dict[str, int | float | str | bool | None] = Field(description="what the form fixes")
    shapes: list[NamedValue] = Field(description="quantities that shape its columns")
    bounds: list[list[float]] = Field(description="lower and upper bound of each shape")
    coefficients: list[NamedValue] = Field(description="linear coefficients")


class ModelDocument(ResultModel):
    """An extended model, schema tauscope.model/1."""

    schema_id: Literal["tauscope.model/1"] = Field(default="tauscope.model/1", alias="schema", description="form")
    robot: str = Field(description="name of the robot")
    joints: list[str] = Field(description="names of its joints, in chain order")
    base_parameters: list[NamedValue] = Field(description="identifiable combinations [SI]")
    links: list[list[float]] = Field(description="nearest physically consistent standard parameters, ten a link")
    friction: list[JointFrictionEntry] = Field(description="one a joint")
    effects: list[EffectEntry] = Field(description="what the nominal model left out")
    covariance: list[list[float]] = Field(
        default=[],
        description="of the base parameters, then of each joint's stiction, stribeck where it has one,"
        " viscous and offset; empty where the values are exact",
    )


def list_friction(structure: ModelStructure, values: Mapping[str, float]) -> list[JointFrictionEntry]:
    """Nominal friction of every joint; a term that the model does not have is zero."""
    return [
        JointFrictionEntry(
            joint=joint.name,
            stiction=values.get(f"stiction {joint.name}", 0.0),
            stribeck=values.get(f"stribeck {joint.name}"),
            viscous=values.get(f"viscous {joint.name}", 0.0),
            offset=values.get(f"offset {joint.name}", 0.0),
            k_v=float(terms.k_v),
            delta=None if terms.delta is None else float(terms.delta),
        )
        for joint, terms in zip(structure.robot.joints, structure.terms, strict=True)
    ]


def model_document(diagnosis: Diagnosis) -> ModelDocument:
    """The final model of a diagnosis as a document."""
    fit = diagnosis.selection.fit
    structure, size = fit.model.structure, fit.model.structure.size
    names = [joint.name for joint in diagnosis.robot.joints]
    values = dict(zip(structure.names, map(float, fit.model.parameters), strict=True))
    return ModelDocument(
        robot=diagnosis.robot.name,
        joints=names,
        base_parameters=[NamedValue(name=name, value=values[name]) for name in structure.base.expressions],
        links=[[float(value) for value in link.to_vector()] for link in consistent_links(diagnosis)],
        friction=list_friction(structure, values),
        effects=[_entry(term, names) for term in fit.model.terms],
        covariance=(fit.covariance[:size, :size] * diagnosis.inflation).tolist(),
    )


def restore_model(document: ModelDocument, robot: Robot) -> ExtendedModel:
    """The extended model of a document. Raises IdentificationError for another arm or an effect that is not there."""
    names = [joint.name for joint in robot.joints]
    base = base_parameters(robot)
    known = {entry.name: entry.value for entry in document.base_parameters}
    if document.joints != names or set(known) != set(base.expressions):
        raise IdentificationError(
            f"the model of {shown(document.robot)} has other joints or links than robot {shown(robot.name)}: "
            "take the robot file that it was made with"
        )
    terms = tuple(JointTerms(entry.k_v, entry.delta) for entry in document.friction)
    structure = ModelStructure(robot, base, terms)
    for entry in document.friction:
        values = {"stiction": entry.stiction, "stribeck": entry.stribeck, "viscous": entry.viscous}
        known |= {f"{name} {entry.joint}": value for name, value in values.items() if value is not None}
        known[f"offset {entry.joint}"] = entry.offset
    rows = document.covariance
    if rows and [len(row) for row in rows] != [structure.size] * structure.size:
        raise IdentificationError(
            f"covariance: is not square with a row for each of {structure.size} parameters;"
            " give a file that diagnose --model wrote"
        )
    return ExtendedModel(
        structure=structure,
        parameters=np.array([known[name] for name in structure.names]),
        links=np.array(document.links, dtype=np.float64).ravel(),
        constants=(),
        stated=(),
        terms=tuple(_term(entry, names) for entry in document.effects),
        covariance=np.array(rows, dtype=np.float64) if rows else None,
    )


def _entry(term: Term, names: list[str]) -> EffectEntry:
    effect = term.effect
    own = {each.name: getattr(effect, each.name) for each in fields(effect) if each.name not in PLACES}
    return EffectEntry(
        effect=effect.id,
        form=type(effect).__name__,
        joint=None if effect.joint is None else names[effect.joint],
        equation=effect.equation,
        settings={name: value.item() if isinstance(value, np.generic) else value for name, value in own.items()},
        shapes=[NamedValue(name=s.name, value=float(v)) for s, v in zip(effect.shapes, term.shape, strict=True)],
        bounds=[[float(a), float(b)] for a, b in zip(effect.lower, effect.upper, strict=True)],
        coefficients=[
            NamedValue(name=c.name, value=float(v)) for c, v in zip(effect.coefficients, term.coefficients, strict=True)
        ],
    )


def _term(entry: EffectEntry, names: list[str]) -> Term:
    kind = _forms().get((entry.effect, entry.form))
    if kind is None or (entry.joint is not None and entry.joint not in names):
        place = entry.effect if entry.joint is None else f"{entry.effect}@{entry.joint}"
        raise IdentificationError(f"effect {shown(place)} is not known here: install the plugin that has it")
    shape = np.array([each.value for each in entry.shapes])
    bounds = np.array(entry.bounds).reshape(-1, 2)
    settings: dict[str, Any] = dict(entry.settings)
    joint = None if entry.joint is None else names.index(entry.joint)
    effect = kind(joint, shape[None], bounds[:, 0], bounds[:, 1], **settings)
    return Term(effect, shape, np.array([each.value for each in entry.coefficients]))


def _forms() -> dict[tuple[str, str], type[Effect]]:
    """Classes of the catalogue's effects, by id and name: one that is listed there may bring forms of other classes."""
    known = {kind.id for kind in catalogue()}
    kinds = [kind for kind in _derived(Effect) if not isabstract(kind)]
    return {(kind.id, kind.__name__): kind for kind in kinds if kind.id in known}


def _derived(kind: type[Effect]) -> list[type[Effect]]:
    """All classes derived from one."""
    return [each for own in kind.__subclasses__() for each in (own, *_derived(own))]
