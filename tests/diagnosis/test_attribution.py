"""Which numbers of which link explain a surplus: torque by Pinocchio of arms with one body changed."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pinocchio as pin  # pyright: ignore[reportMissingImports]
import pytest

from arms import Array, panda_like, random_parameters
from pinocchio_arm import pinocchio_model
from tauscope.diagnosis.against.attribution import Attribution, Explanation
from tauscope.diagnosis.against.wrong_values import attribute
from tauscope.diagnosis.findings.diagnosed import ParameterDifference
from tauscope.dynamics import torque_regressor
from tauscope.dynamics.base_parameters import base_parameters
from tauscope.identification.consistency import plausible_prior
from tauscope.robot import LinkInertia, Model

ARM, BASE = panda_like(), base_parameters(panda_like())
STATED = random_parameters(np.random.default_rng(3), 7)
SHIFT = np.array([0.05, 0.0, 0.02])
SAMPLES, NOISE = 300, 0.3

Change = Callable[[pin.Inertia], pin.Inertia]


def heavier(body: pin.Inertia) -> pin.Inertia:
    """A wrong <mass> of a URDF: centre of mass and inertia about it are right."""
    return pin.Inertia(body.mass + 0.7, body.lever, body.inertia)


def denser(body: pin.Inertia) -> pin.Inertia:
    return pin.Inertia(1.4 * body.mass, body.lever, 1.4 * body.inertia)


def off_centre(body: pin.Inertia) -> pin.Inertia:
    return pin.Inertia(body.mass, body.lever + SHIFT, body.inertia)


def rounder(body: pin.Inertia) -> pin.Inertia:
    return pin.Inertia(body.mass, body.lever, body.inertia + np.diag([0.1, 0.0, 0.0]))


def loaded(body: pin.Inertia) -> pin.Inertia:
    return body + pin.Inertia(0.7, np.array([0.1, 0.05, 0.1]), np.zeros((3, 3)))


def surplus(changes: dict[int, Change], seed: int) -> tuple[Array, Array]:
    """What noisy torque of the changed arm says of its base parameters beyond the stated ones, and its covariance."""
    rng = np.random.default_rng(seed)
    states = [scale * rng.uniform(-1.0, 1.0, (SAMPLES, 7)) for scale in (1.5, 1.7, 3.4)]
    real, stated = pinocchio_model(ARM, STATED), pinocchio_model(ARM, STATED)
    for link, change in changes.items():
        real.inertias[link] = change(real.inertias[link])
    torque = [
        [pin.rnea(model, data, *state) for state in zip(*states, strict=True)]
        for model, data in ((real, real.createData()), (stated, stated.createData()))
    ]
    left = np.array(torque[0]) - np.array(torque[1]) + NOISE * rng.standard_normal((SAMPLES, 7))
    columns = torque_regressor(ARM, *states).reshape(-1, 70)[:, BASE.independent_columns]
    covariance = NOISE**2 * np.linalg.inv(columns.T @ columns)
    return covariance @ (columns.T @ left.ravel()) / NOISE**2, np.asarray(covariance, dtype=np.float64)


def attribution(changes: dict[int, Change], seed: int, links: Array | None = STATED) -> Attribution:
    model = Model(tuple(LinkInertia.from_vector(row) for row in STATED.reshape(7, 10)), None)
    prior = plausible_prior(replace(ARM, model=model), np.zeros((1, 70)), np.zeros(1)).widen(2.0)
    believed = np.asarray(np.linalg.inv(prior.root.T @ prior.root), dtype=np.float64)
    return Attribution(BASE, *surplus(changes, seed), links, believed)


def explanations(changes: dict[int, Change], seed: int, links: Array | None = STATED) -> tuple[Explanation, ...]:
    return attribution(changes, seed, links).explain()


def titles(found: tuple[Explanation, ...]) -> list[set[str]]:
    return [{each.change.title, *(other.title for other in each.equivalent)} for each in found]


@pytest.mark.parametrize("link", [4, *(pytest.param(link, marks=pytest.mark.slow) for link in (3, 5, 7))])
@pytest.mark.parametrize(
    ("change", "title"),
    [
        (heavier, "mass"),
        (denser, "mass"),
        (off_centre, "centre of mass"),
        (rounder, "inertia"),
        (loaded, "mass and centre of mass"),
    ],
)
def test_one_wrong_body_is_one_explanation(change: Change, title: str, link: int) -> None:
    (found,) = titles(explanations({link: change}, link))
    assert f"{title} of link {link}" in found


@pytest.mark.slow
def test_a_right_arm_needs_none() -> None:
    assert [explanations({}, seed) for seed in range(20)] == [()] * 20


@pytest.mark.slow
def test_where_all_bodies_are_wrong_each_is_one_number() -> None:
    found = explanations(dict.fromkeys(range(1, 8), denser), 1)
    assert {each.change.title for each in found} == {f"mass of link {link}" for link in range(1, 8)}


def test_two_wrong_bodies_are_two_explanations() -> None:
    found = explanations({3: denser, 6: off_centre}, 1)
    assert {each.change.title for each in found} == {"mass of link 3", "centre of mass of link 6"}


@pytest.mark.parametrize(
    ("link", "change", "carried"), [(7, loaded, True), (7, heavier, False), (7, off_centre, False), (6, loaded, False)]
)
def test_a_payload_is_a_body_at_the_tool_that_no_single_number_explains(
    link: int, change: Change, carried: bool
) -> None:
    assert (attribution({link: change}, link).payload() is not None) is carried


def differences(real: Array, covariance: Array) -> list[ParameterDifference]:
    stated = BASE.project(STATED)
    std = np.sqrt(np.diag(covariance))
    rows = zip(BASE.expressions, stated, stated + real, std, strict=True)
    found = [ParameterDifference(name, float(given), float(own), float(error)) for name, given, own, error in rows]
    return [each for each in found if abs(each.in_std) > 4.0]


def test_the_mass_is_stated_with_all_that_it_explains() -> None:
    found = explanations({6: heavier}, 2)
    wrong = attribute(differences(*surplus({6: heavier}, 2)), BASE.expressions, found, STATED, ARM.joints, 4.0)
    values = {value for each in wrong for value in each.explained_by}
    (mass,) = values
    (quantity,) = mass.quantities
    assert (mass.link, quantity.name, quantity.unit) == (5, "mass", "kg")
    assert quantity.simulation == pytest.approx(STATED[56])
    assert abs(quantity.value - STATED[56] - 0.7) < 4.0 * quantity.std
    assert mass.explains == mass.among == len(wrong) > 5
    assert mass.statement([]).startswith("Mass of link 6 is ")
    assert mass.statement([]).endswith(f": that explains all {len(wrong)} differences")


def test_without_stated_links_the_difference_is_told() -> None:
    found = explanations({6: loaded}, 3, links=None)
    wrong = attribute(differences(*surplus({6: loaded}, 3)), BASE.expressions, found, None, ARM.joints, 4.0)
    (body,) = {value for each in wrong for value in each.explained_by}
    values = {each.name: each for each in body.quantities}
    assert all(each.simulation is None for each in body.quantities)
    for name, value in (("added_mass", 0.7), ("added_centre_of_mass_x", 0.1)):
        assert abs(values[name].value - value) < 4.0 * values[name].std
    assert body.statement([]).startswith("Added mass of link 6 is ")
