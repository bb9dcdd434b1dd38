"""The prior of bodies about a body: its slopes and curvature against differences, and steps that no body leaves."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from arms import random_parameters
from tauscope.diagnosis.evidence.bodies import BodyPrior, pseudo_inertia

Array = NDArray[np.float64]
SEEDS = st.integers(0, 10_000)


def prior(seed: int, links: int = 2) -> tuple[BodyPrior, Array, Array]:
    """A prior, its mean, and other bodies."""
    draws = np.random.default_rng(seed)
    mean, bodies = (random_parameters(draws, links) for _ in range(2))
    root = draws.standard_normal((10 * links, 10 * links))
    base = draws.standard_normal((7, 10 * links))
    return BodyPrior(base, mean, root @ root.T + np.eye(10 * links)), mean, bodies


def log_prior(own: BodyPrior, links: Array) -> float:
    off = links - own.mean
    volumes = [np.linalg.slogdet(pseudo_inertia(each))[1] for each in links.reshape(-1, 10)]
    return -0.5 * float(off @ own.precision @ off) + float(np.sum(volumes))


@settings(max_examples=15)
@given(SEEDS)
def test_a_base_parameter_is_as_probable_as_its_most_probable_bodies(seed: int) -> None:
    """With ten base parameters that are the links' own, the normal distribution is the prior's second order."""
    own, _, bodies = prior(seed, links=1)
    own = BodyPrior(np.eye(10), own.mean, own.precision)
    about = own.about(bodies)
    np.testing.assert_allclose(about.links(bodies), bodies, rtol=1e-6, atol=1e-9)
    scale = 1.0 / np.sqrt(np.diag(about.precision))
    for direction in np.eye(10) * scale[:, None]:
        ahead, here, behind = (log_prior(own, bodies + t * 1e-3 * direction) for t in (1.0, 0.0, -1.0))
        slope = float((about.mean - bodies) @ about.precision @ direction)
        assert (ahead - behind) / 2e-3 == pytest.approx(slope, rel=1e-3, abs=1e-3)
        assert (ahead - 2.0 * here + behind) / 1e-6 == pytest.approx(-1.0, rel=0.05)


@settings(max_examples=15)
@given(SEEDS)
def test_what_base_parameters_say_of_bodies_makes_these_base_parameters(seed: int) -> None:
    own, _, bodies = prior(seed)
    about, asked = own.about(bodies), np.random.default_rng(seed).standard_normal(7)
    np.testing.assert_allclose(own.base @ about.links(asked), asked, rtol=1e-6, atol=1e-6)


@given(SEEDS, st.floats(0.1, 1e3))
def test_no_step_leaves_the_bodies(seed: int, size: float) -> None:
    own, _, bodies = prior(seed)
    step = size * np.abs(bodies).max() * np.random.default_rng([seed, 2]).standard_normal(len(bodies))
    moved = bodies + own.share(bodies, step) * step
    assert all(np.linalg.eigvalsh(pseudo_inertia(each))[0] > 0.0 for each in moved.reshape(-1, 10))


def test_a_start_has_volume_where_the_bodies_have_none() -> None:
    own, _, bodies = prior(1)
    bodies[10:] = 0.0
    found = own.start(bodies)
    assert all(np.linalg.eigvalsh(pseudo_inertia(each))[0] > 0.0 for each in found.reshape(-1, 10))


@given(SEEDS, st.floats(1e-8, 1e-6))
def test_bodies_may_be_as_thin_as_rounding_lets_them(seed: int, share: float) -> None:
    own, _, bodies = prior(seed)
    thin = np.concatenate([flatten(each, share) for each in bodies.reshape(-1, 10)])
    assert np.linalg.eigvalsh(own.about(thin).precision).min() > 0.0


def flatten(link: Array, share: float) -> Array:
    """A body with a small share of its second moments along two of its axes."""
    moments, axes = np.linalg.eigh(pseudo_inertia(link))
    inertia = axes @ np.diag(moments * [share, share, 1.0, 1.0]) @ axes.T
    of_parameters = np.stack([pseudo_inertia(unit).ravel() for unit in np.eye(10)], axis=1)
    return np.asarray(np.linalg.lstsq(of_parameters, inertia.ravel())[0], dtype=np.float64)


def test_another_unit_of_mass_changes_nothing_but_the_unit() -> None:
    own, _, bodies = prior(4)
    heavier = BodyPrior(own.base, 1000.0 * own.mean, own.precision / 1e6)
    about, in_grams = own.about(bodies), heavier.about(1000.0 * bodies)
    np.testing.assert_allclose(in_grams.mean, 1000.0 * about.mean, rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(in_grams.precision, about.precision / 1e6, rtol=1e-6, atol=1e-12)


@given(SEEDS)
def test_a_body_that_grows_thinner_and_thinner_ends_where_double_numbers_do(seed: int) -> None:
    own, _, bodies = prior(seed)
    step = np.abs(bodies).max() * np.random.default_rng([seed, 2]).standard_normal(len(bodies))
    for _ in range(40):
        bodies = bodies + own.share(bodies, step) * step
    assert all(np.linalg.eigvalsh(pseudo_inertia(each))[0] > 0.0 for each in bodies.reshape(-1, 10))
