"""Which inertias are accepted: the condition on the pseudo-inertia, and its words."""

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from tauscope.robot import LinkInertia, Severity, find_defect, pseudo_inertia

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
def test_refused_exactly_where_the_pseudo_inertia_has_a_negative_eigenvalue(seed: int) -> None:
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
    defect = find_defect(link)
    if eigenvalues[0] > 0.0:
        assert defect is None
    else:
        assert defect is not None


REFUSED = {
    "negative mass": (_link(-1.0, (0, 0, 0), 1, 1, 1, 0, 0, 0), "mass -1 kg is negative"),
    "moment without mass": (
        _link(0.0, (0.1, 0, 0), 1, 1, 1, 0, 0, 0),
        "mass is zero but the first moment is [0.1, 0, 0]",
    ),
    "negative moment": (_link(1.0, (0, 0, 0), -0.1, 1, 1, 0, 0, 0), "centre of mass are -0.1, 1, 1 kg m²"),
    "triangle": (_link(1.0, (0, 0, 0), 1, 1, 2.1, 0, 0, 0), "1, 1, 2.1 kg m², and 1 + 1 < 2.1"),
    "products too large": (_link(1.0, (0, 0, 0), 1, 1, 1, 2, 0, 0), "not positive semidefinite"),
    "about the wrong point": (_link(2.0, (1.0, 0, 0), 0.01, 0.02, 0.02, 0, 0, 0), "not positive semidefinite"),
    "triangle at the centre only": (_link(1.0, (0, 0, 0.3), 0.1, 0.1, 0.15, 0, 0, 0), "0.01 + 0.01 < 0.15"),
    "point mass without inertia": (_link(1.0, (0.3, 0, 0), 0, 0, 0, 0, 0, 0), "alone makes 0.09 kg m²"),
    "overflow": (_link(5e-324, (1e9, 0, 0), 1, 1, 1, 0, 0, 0), "not positive semidefinite"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_refusal_names_the_condition_and_its_numbers(name: str) -> None:
    link, message = REFUSED[name]
    defect = find_defect(link)
    assert defect is not None
    assert defect.severity is Severity.ERROR
    assert message in defect.text


ACCEPTED = {
    "nothing known": _link(0.0, (0, 0, 0), 0, 0, 0, 0, 0, 0),
    "point mass at the origin": _link(1.4, (0, 0, 0), 0, 0, 0, 0, 0, 0),
    "point mass": _link(0.2, (0, 0, 0.0084), 3.528e-4, 3.528e-4, 0, 0, 0, 0),
    "thin plate": _link(1.0, (0, 0, 0), 1, 2, 3, 0, 0, 0),
    "slender rod": _link(np.sqrt(2), (-np.sqrt(2) / 4, 0, 0), 0, np.sqrt(2) / 12, np.sqrt(2) / 12, 0, 0, 0),
    "small": _link(1e-9, (0, 0, 0), 1e-15, 1e-15, 1e-15, 0, 0, 0),
}


@pytest.mark.parametrize("name", ACCEPTED)
def test_bodies_on_the_border_are_physical(name: str) -> None:
    assert find_defect(ACCEPTED[name]) is None


def test_rounded_digits_are_a_warning() -> None:
    defect = find_defect(_link(1.0, (0, 0, 0), 0.3333, 0.3333, 0.6667, 0, 0, 0))
    assert defect is not None
    assert defect.severity is Severity.WARNING


def test_slightly_more_than_rounding_is_refused() -> None:
    defect = find_defect(_link(1.0, (0, 0, 0), 0.01, 0.01, 0.0201, 0, 0, 0))
    assert defect is not None
    assert defect.severity is Severity.ERROR


@pytest.mark.parametrize(
    "link",
    [
        _link(1.0, (0, 0, 0), -1e-5, 1.0, 5.0, 0, 0, 0),
        _link(1.0, (0, 0, 0.9), 1.0, 1.0, 2.0001, 0, 0, 0),
    ],
)
def test_rounded_digits_do_not_hide_a_greater_violation(link: LinkInertia) -> None:
    defect = find_defect(link)
    assert defect is not None
    assert defect.severity is Severity.ERROR
    assert "triangle inequality" in defect.text
