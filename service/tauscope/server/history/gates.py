"""Acceptance gates: the bounds by which a new model is judged, and each gate's finding."""

from collections.abc import Iterator, Sequence
from typing import Annotated

import numpy as np
from pydantic import Field, FiniteFloat

from tauscope.identification.result import IdentificationDocument, LinkEntry
from tauscope.robot import LinkInertia, pseudo_inertia
from tauscope.strict_model import ResultModel, entry

Ratio = Annotated[FiniteFloat, Field(ge=1.0)]
Positive = Annotated[FiniteFloat, Field(gt=0.0)]


class ModelPolicy(ResultModel):
    """Bounds for one robot."""

    held_out_error: Positive = Field(default=0.2, description="largest relative error on held-out recordings")
    held_out_ratio: Ratio = Field(default=1.5, description="largest held-out residual, in training residuals or noise")
    consistency_ratio: Ratio = Field(default=1.2, description="largest residual with bodies, in free residuals")
    condition_number: Ratio = Field(default=500.0, description="largest condition number of the regressor")
    drift_std: Positive = Field(default=6.0, description="change that counts as drift, in joint standard errors")
    drift_share: Positive = Field(default=0.25, description="and in parts of the earlier value: both have to be passed")


@entry
class Gate:
    name: str = Field(description="held_out, consistency, excitation, structure, newer, source or diagnosis")
    passed: bool = Field(description="whether it is met")
    reason: str = Field(description="what was found, what is allowed, and what to do where it is not met")


def check_gates(
    document: IdentificationDocument, policy: ModelPolicy, active: IdentificationDocument | None = None
) -> tuple[Gate, ...]:
    gates = [_held_out(document, policy), _consistency(document, policy), _excitation(document, policy)]
    return tuple(gates if active is None else [*gates, _structure(document, active)])


def passes(gates: Sequence[Gate]) -> bool:
    return all(gate.passed for gate in gates)


def _held_out(document: IdentificationDocument, policy: ModelPolicy) -> Gate:
    """The model explains motions that it was not made from about as well as those that it was made from."""
    fit = document.fit.held_out
    if fit is None:
        return Gate("held_out", False, "no held-out recording: nothing shows that it holds on other motions; add one")
    if fit.relative_error > policy.held_out_error:
        found = f"relative error {fit.relative_error:.3g} on held-out motions, allowed {policy.held_out_error:.3g}"
        return Gate("held_out", False, f"{found}; look for what changed between the recordings")
    floor = [max(rms, noise) for rms, noise in zip(document.fit.train.rms, document.noise_std, strict=True)]
    worst, joint = max(_ratios(fit.rms, floor, document.joints))
    found = f"{joint}: held-out residual {worst:.2f} times that of the training, allowed {policy.held_out_ratio:.2f}"
    if worst > policy.held_out_ratio:
        return Gate("held_out", False, f"{found}; record a longer or richer motion")
    return Gate("held_out", True, f"relative error {fit.relative_error:.3g}; {found}")


def _consistency(document: IdentificationDocument, policy: ModelPolicy) -> Gate:
    """Real bodies can have these parameters, and explain the data about as well as free ones."""
    for number, link in enumerate(document.links, start=1):
        if not is_physical(link):
            return Gate("consistency", False, f"link {number}: no real body has this mass and inertia; identify anew")
    price = document.fit.price_of_bodies or [1.0] * len(document.joints)
    worst, joint = max(zip(price, document.joints, strict=True))
    found = (
        f"{joint}: residual of the model with bodies {worst:.2f} times that of the free one,"
        f" allowed {policy.consistency_ratio:.2f}"
    )
    if worst > policy.consistency_ratio:
        return Gate("consistency", False, f"{found}; something is missing in the model: diagnose the recordings")
    return Gate("consistency", True, found)


def _excitation(document: IdentificationDocument, policy: ModelPolicy) -> Gate:
    if document.undetermined:
        names = ", ".join(document.undetermined[:3])
        return Gate("excitation", False, f"the recordings say nothing about {names}; record a richer motion")
    found = f"condition number {document.condition_number:.3g}, allowed {policy.condition_number:.3g}"
    if document.condition_number > policy.condition_number:
        return Gate("excitation", False, f"{found}; record a motion of `tauscope excite`")
    return Gate("excitation", True, found)


def _structure(document: IdentificationDocument, active: IdentificationDocument) -> Gate:
    if document.joints != active.joints:
        return Gate("structure", False, "other joints than the active model's; activate it by hand if the arm changed")
    names, known = ([each.name for each in model.base_parameters] for model in (document, active))
    if names != known:
        reason = "other base parameters than the active model's: the kinematics differ; if so, activate it by hand"
        return Gate("structure", False, reason)
    return Gate("structure", True, "the same joints and base parameters as the active model")


def is_physical(link: LinkEntry) -> bool:
    """Whether a link's pseudo-inertia [[½ tr(I) 1 − I, m s], [(m s)ᵀ, m]] has no negative eigenvalue."""
    i = link.inertia
    inertia = np.array([[i.xx, i.xy, i.xz], [i.xy, i.yy, i.yz], [i.xz, i.yz, i.zz]])
    eigenvalues = np.linalg.eigvalsh(pseudo_inertia(LinkInertia(link.mass, np.array(link.first_moment), inertia)))
    return bool(eigenvalues[0] >= -1e-6 * max(eigenvalues[-1], 1e-12))


def _ratios(rms: Sequence[float], floor: Sequence[float], joints: Sequence[str]) -> Iterator[tuple[float, str]]:
    for value, reference, joint in zip(rms, floor, joints, strict=True):
        yield (value / reference if reference > 0.0 else (1.0 if value == 0.0 else float("inf"))), joint
