"""Which inertias a body can have, the words for others, and the nearest body."""

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from tauscope.robot import LinkInertia, find_defect, nearest_body, pseudo_inertia

COORDINATE = st.floats(-1.0, 1.0)


def _link(mass: float, first_moment: tuple[float, ...], *entries: float) -> LinkInertia:
    xx, yy, zz, xy, xz, yz = entries
    return LinkInertia(mass, np.array(first_moment), np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))


@given(st.lists(st.tuples(st.floats(0.0, 5.0), COORDINATE, COORDINATE, COORDINATE), min_size=1, max_size=6))
@example([(2.0e-159, 0.0, 0.0, 0.5)])
def test_any_cloud_of_point_masses_is_physical(points: list[tuple[float, float, float, float]]) -> None:
    masses = np.array([point[0] for point in points])
    places = np.array([point[1:] for point in points])
    inertia = np.einsum("p,pkl->kl", masses, [np.dot(r, r) * np.eye(3) - np.outer(r, r) for r in places])
    defect = find_defect(LinkInertia(float(masses.sum()), masses @ places, inertia))
    assert defect is None


@given(st.integers(0, 2**32 - 1))
def test_a_defect_exactly_where_the_pseudo_inertia_has_a_negative_eigenvalue(seed: int) -> None:
    rng = np.random.default_rng(seed)
    factor = rng.normal(size=(4, 4))
    eigenvalues = np.abs(rng.normal(size=4)) + 0.05
    if rng.uniform() < 0.5:
        eigenvalues[0] *= -1.0
    rotation = np.linalg.qr(factor)[0]
    pseudo = rotation @ np.diag(eigenvalues) @ rotation.T
    second_moments = pseudo[:3, :3]
    link = LinkInertia(pseudo[3, 3], pseudo[:3, 3], np.trace(second_moments) * np.eye(3) - second_moments)
    np.testing.assert_allclose(pseudo_inertia(link), pseudo, atol=1e-12)
    assert (find_defect(link) is None) == bool(eigenvalues[0] > 0.0)
    assert (nearest_body(link) is link) == bool(eigenvalues[0] > 0.0)


DEFECTS = {
    "negative mass": (_link(-1.0, (0, 0, 0), 1, 1, 1, 0, 0, 0), "mass -1 kg is negative"),
    "moment without mass": (
        _link(0.0, (0.1, 0, 0), 1, 1, 1, 0, 0, 0),
        "mass is zero but the first moment is [0.1, 0, 0]",
    ),
    "negative moment": (_link(1.0, (0, 0, 0), -0.1, 1, 1, 0, 0, 0), "centre of mass are -0.1, 1, 1 kg m²"),
    "triangle": (_link(1.0, (0, 0, 0), 1, 1, 2.1, 0, 0, 0), "1 + 1 < 2.1 kg m²"),
    "products too large": (_link(1.0, (0, 0, 0), 1, 1, 1, 2, 0, 0), "not positive semidefinite"),
    "about the wrong point": (_link(2.0, (1.0, 0, 0), 0.01, 0.02, 0.02, 0, 0, 0), "not positive semidefinite"),
    "triangle at the centre only": (_link(1.0, (0, 0, 0.3), 0.1, 0.1, 0.15, 0, 0, 0), "0.01 + 0.01 < 0.15"),
    "point mass without inertia": (_link(1.0, (0.3, 0, 0), 0, 0, 0, 0, 0, 0), "alone makes 0.09 kg m²"),
    "overflow": (_link(5e-324, (1e9, 0, 0), 1, 1, 1, 0, 0, 0), "not positive semidefinite"),
}


@pytest.mark.parametrize("name", DEFECTS)
def test_a_defect_names_the_condition_and_its_numbers(name: str) -> None:
    link, message = DEFECTS[name]
    assert message in str(find_defect(link))
    assert find_defect(nearest_body(link), 1e-9) is None


BODIES = {
    "nothing known": _link(0.0, (0, 0, 0), 0, 0, 0, 0, 0, 0),
    "point mass at the origin": _link(1.4, (0, 0, 0), 0, 0, 0, 0, 0, 0),
    "point mass": _link(0.2, (0, 0, 0.0084), 3.528e-4, 3.528e-4, 0, 0, 0, 0),
    "thin plate": _link(1.0, (0, 0, 0), 1, 2, 3, 0, 0, 0),
    "slender rod": _link(np.sqrt(2), (-np.sqrt(2) / 4, 0, 0), 0, np.sqrt(2) / 12, np.sqrt(2) / 12, 0, 0, 0),
    "small": _link(1e-9, (0, 0, 0), 1e-15, 1e-15, 1e-15, 0, 0, 0),
    "a motor without mass": _link(0.0, (0, 0, 0), 0.1, 0.1, 0.1, 0, 0, 0),
}


@pytest.mark.parametrize("name", BODIES)
def test_bodies_on_the_border_stay_untouched(name: str) -> None:
    assert find_defect(BODIES[name]) is None
    assert nearest_body(BODIES[name]) is BODIES[name]


def test_rounded_digits_are_no_defect_but_are_mended() -> None:
    rounded = _link(1.0, (0, 0, 0), 0.3333, 0.3333, 0.6667, 0, 0, 0)
    assert find_defect(rounded) is None
    assert find_defect(rounded, 1e-9) is not None
    assert find_defect(nearest_body(rounded), 1e-9) is None


def test_slightly_more_than_rounding_is_a_defect() -> None:
    assert find_defect(_link(1.0, (0, 0, 0), 0.01, 0.01, 0.0201, 0, 0, 0)) is not None


@pytest.mark.parametrize(
    "link",
    [
        _link(1.0, (0, 0, 0), -1e-5, 1.0, 5.0, 0, 0, 0),
        _link(1.0, (0, 0, 0.9), 1.0, 1.0, 2.0001, 0, 0, 0),
    ],
)
def test_rounded_digits_do_not_hide_a_greater_violation(link: LinkInertia) -> None:
    assert "triangle inequality" in str(find_defect(link))


SIZED = st.floats(-1e3, 1e3).filter(lambda value: value == 0.0 or abs(value) > 1.0)


@given(st.lists(st.floats(-1e9, 1e9), min_size=10, max_size=10))
@example([0.0] * 6 + [0.0, 1e-300, 0.0, 0.0])
@example([1e9] * 6 + [5e-324, 1e9, 0.0, 0.0])
@example([-1e9] * 3 + [0.0] * 4 + [1e-160, 0.0, 0.0])
@example([0.02, 0.02, 0.02, 0.0, 0.0, 0.0, 0.0, 0.1, 0.0, 0.0])
def test_the_nearest_body_of_any_numbers_is_a_body(vector: list[float]) -> None:
    found = nearest_body(LinkInertia.from_vector(np.array(vector)))
    assert np.isfinite(found.to_vector()).all()
    assert find_defect(found, 1e-8) is None


@given(st.lists(SIZED, min_size=10, max_size=10))
def test_a_positive_mass_stays_where_it_is_and_no_other_body_is_nearer(vector: list[float]) -> None:
    link = LinkInertia.from_vector(np.array(vector))
    found = nearest_body(link)
    if link.mass <= 0.0:
        return
    assert found.mass == link.mass
    np.testing.assert_array_equal(found.first_moment, link.first_moment)
    second = np.trace(found.inertia - link.inertia) / 2 * np.eye(3) - (found.inertia - link.inertia)
    centred = pseudo_inertia(found)[:3, :3] - np.outer(link.first_moment, link.first_moment) / link.mass
    # A projection onto a cone: what is added is in the dual cone and at right angles to the result.
    scale = np.max(np.abs(link.to_vector())) + np.linalg.norm(link.first_moment) ** 2 / link.mass
    assert np.linalg.eigvalsh(second)[0] > -1e-12 * scale
    assert abs(np.sum(second * centred)) < 1e-9 * scale**2


MODERATE = SIZED.map(lambda value: value / 100.0)
"""Numbers of an arm: no centre of mass lies where the robot file could not state the moment of inertia."""


@given(st.lists(MODERATE, min_size=10, max_size=10), st.sampled_from([1e-3, 1.0]), st.sampled_from([1e-3, 1.0, 10.0]))
def test_the_nearest_body_does_not_depend_on_units(vector: list[float], gram: float, millimetre: float) -> None:
    units = gram * np.array([millimetre**2] * 6 + [1.0] + [millimetre] * 3)
    found = nearest_body(LinkInertia.from_vector(np.array(vector))).to_vector()
    other = nearest_body(LinkInertia.from_vector(np.array(vector) * units)).to_vector() / units
    np.testing.assert_allclose(other, found, rtol=1e-6, atol=1e-6 * np.max(np.abs(found)))
