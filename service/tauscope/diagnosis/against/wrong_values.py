"""Differences of parameters attributed to the quantities of links and joints that explain them."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tauscope.diagnosis.against.attribution import Explanation
from tauscope.diagnosis.against.link_changes import MASS, MOMENTS, QUANTITIES, SIZE, UNITS, LinkChange
from tauscope.diagnosis.findings.diagnosed import ParameterDifference
from tauscope.diagnosis.findings.wrong_value import WrongQuantity, WrongValue
from tauscope.recording.recording import Array
from tauscope.robot import Joint, JointType

CLEAR = 3.0  # standard errors from which a quantity differs from its stated value
NOTABLE = 0.1  # part of a difference from which a change contributes to it
JOINT_UNITS = {
    JointType.REVOLUTE: {"viscous": "Nm s/rad", "rotor_inertia": "kg m²"},
    JointType.PRISMATIC: {"viscous": "N s/m", "rotor_inertia": "kg"},
}
_CENTRE = tuple(f"centre_of_mass_{axis}" for axis in "xyz")


def attribute(
    differences: Sequence[ParameterDifference],
    names: Sequence[str],
    explanations: Sequence[Explanation],
    links: Array | None,
    joints: Sequence[Joint],
    several: float,
) -> tuple[ParameterDifference, ...]:
    """The differences, each with what explains it.

    `names`: of the base parameters; `links`: (10 n,), stated standard parameters; None where only their base parameters
    are known; `several`: standard errors within which a difference is explained.
    """
    places = {name: place for place, name in enumerate(names)}
    values = [
        _name_link(each, None if links is None else links.reshape(-1, SIZE)[each.change.link]) for each in explanations
    ]
    causes: list[list[WrongValue]] = []
    for difference in differences:
        place = places.get(difference.parameter)
        if place is None:
            causes.append(_name_joint(difference, joints))
            continue
        size = difference.real - difference.simulation
        effects = [float(each.effect[place]) for each in explanations]
        whole = abs(size - sum(effects)) <= max(several * difference.std, NOTABLE * abs(size))
        pairs = zip(values, effects, strict=True)
        notable = [value for value, effect in pairs if abs(effect) > NOTABLE * abs(size)]
        causes.append([value for value in notable if whole and value.quantities])
    counts = {id(value): sum(value in own for own in causes) for value in values}
    told = {
        id(each): replace(each, explains=counts.get(id(each), 1), among=len(differences))
        for own in causes
        for each in own
    }
    return tuple(
        replace(difference, explained_by=tuple(told[id(each)] for each in own))
        for difference, own in zip(differences, causes, strict=True)
    )


def _name_joint(difference: ParameterDifference, joints: Sequence[Joint]) -> list[WrongValue]:
    """A coefficient of one joint, which explains itself."""
    term, _, name = difference.parameter.partition(" ")
    own = [place for place, joint in enumerate(joints) if joint.name == name]
    if not own:
        return []
    kind = joints[own[0]].type
    unit = JOINT_UNITS[kind].get(term, "Nm" if kind is JointType.REVOLUTE else "N")
    quantity = WrongQuantity(term, difference.simulation, difference.real, difference.std, unit)
    return [WrongValue(None, own[0], (quantity,))] if quantity.is_possible else []


def _name_link(explained: Explanation, stated: Array | None) -> WrongValue:
    """The quantities of one link that differ clearly, or else the clearest; none where no body has it."""
    change = explained.change
    quantities = _quantities(explained, np.zeros(SIZE) if stated is None else stated)
    if stated is None:
        quantities = [replace(each, name=f"added_{each.name}", simulation=None) for each in quantities]
    clearness = [abs(each.value - (each.simulation or 0.0)) / each.std for each in quantities]
    clear = [each for each, size in zip(quantities, clearness, strict=True) if size > CLEAR]
    clear = clear or [quantities[int(np.argmax(clearness))]]
    titles = tuple(each.title for each in explained.equivalent)
    return WrongValue(change.link, None, tuple(each for each in clear if each.is_possible), equivalent=titles)


def _quantities(explained: Explanation, stated: Array) -> list[WrongQuantity]:
    """All quantities that a change is about, on the arm and as stated."""
    change = explained.change
    real = stated + change.change(explained.values)
    slope = _slope(change, explained.values, real)
    before, after = _readable(stated), _readable(real)
    std = np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", slope, explained.covariance, slope), np.finfo(float).tiny))
    names, units = (*QUANTITIES, *_CENTRE), (*UNITS, *["m"] * 3)
    found = []
    for place, name in enumerate(names):
        if name in change.quantities:
            known = float(before[place]) if np.isfinite(before[place]) else None
            found.append(WrongQuantity(name, known, float(after[place]), float(std[place]), units[place]))
    return found


def _readable(link: Array) -> Array:
    """Standard parameters of a link, then its centre of mass, (13,)."""
    mass = link[MASS]
    return np.append(link, link[MOMENTS] / mass if mass != 0.0 else np.full(3, np.nan))


def _slope(change: LinkChange, values: Array, real: Array) -> Array:
    """∂ readable / ∂β, (13, k)."""
    own = change.slope(values)
    mass = real[MASS]
    if mass == 0.0:
        return np.concatenate([own, np.zeros((3, own.shape[1]))])
    return np.concatenate([own, (own[MOMENTS] - np.outer(real[MOMENTS] / mass, own[MASS])) / mass])
