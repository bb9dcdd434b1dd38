"""The seed paper's Table 2: grouping, values, LS against WLS, and the Cramér-Rao bound as Pinocchio's columns give it.

Every statistical bound below is a quantile of the statistic's own distribution at `FALSE_ALARM`, not a guess.
"""

from dataclasses import dataclass

import numpy as np
import pytest
from scipy import stats

from identification.simulated import (
    PAPER_NOISE,
    Array,
    SimulatedArm,
    paper_robot,
    rms,
    simulate,
    standard_errors,
    true_parameters,
    z_scores,
)
from pinocchio_arm import pinocchio_regressor
from tauscope.identification import Estimator, Identification, Options, document, identify

STANDARD = ("Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz", "m", "msx", "msy", "msz")

BASE_ROWS: dict[str, tuple[dict[str, float], float]] = {
    "Ixx2 - Iyy2 - 0.5*msx2": ({"Ixx2": 1, "Iyy2": -1, "msx2": -0.5}, 0.059),
    "Ixx3 - Iyy3 - 0.5*msx3": ({"Ixx3": 1, "Iyy3": -1, "msx3": -0.5}, 0.059),
    "Ixy2": ({"Ixy2": 1}, 0.0),
    "Ixy3": ({"Ixy3": 1}, 0.0),
    "Iyy1 + Iyy2 + Iyy3 + 0.5*msx2 + 0.5*msx3": (
        {"Iyy1": 1, "Iyy2": 1, "Iyy3": 1, "msx2": 0.5, "msx3": 0.5},
        -0.117,  # the paper cuts digits here: -0.11785
    ),
    "Ixz2 - 0.5*msz2 - 0.5*msz3": ({"Ixz2": 1, "msz2": -0.5, "msz3": -0.5}, 0.0),
    "Ixz3 - 0.5*msz3": ({"Ixz3": 1, "msz3": -0.5}, 0.0),
    "Iyz2": ({"Iyz2": 1}, 0.0),
    "Iyz3": ({"Iyz3": 1}, 0.0),
    "Izz2 + 0.5*msx2": ({"Izz2": 1, "msx2": 0.5}, -0.059),
    "Izz3 + 0.5*msx3": ({"Izz3": 1, "msx3": 0.5}, -0.059),
    "m2 + 2*msx2 - 2*msx3": ({"m2": 1, "msx2": 2, "msx3": -2}, 1.414),
    "m3 + 2*msx3": ({"m3": 1, "msx3": 2}, 0.707),
    "msy2": ({"msy2": 1}, 0.0),
    "msy3": ({"msy3": 1}, 0.0),
}
"""Rows of Table 2 that belong to the links: symbolic expression, its terms, exact value as printed."""

EXACT_BASE_VALUES = [
    *(np.sqrt(2) / 24, np.sqrt(2) / 24, 0.0, 0.0, -np.sqrt(2) / 12, 0.0, 0.0, 0.0, 0.0),
    *(-np.sqrt(2) / 24, -np.sqrt(2) / 24, np.sqrt(2), np.sqrt(2) / 2, 0.0, 0.0),
]
"""The same rows to full precision."""

FRICTION_ROWS = {
    "stiction": (2.0, 1.0, 2.0),
    "viscous": (0.5, 0.277, 0.03),
    "stribeck": (-0.3, -0.2, -0.3),
}
"""The other nine rows, joints 1 to 3."""

PRINTED = 1e-3
"""One in the last digit that the paper prints."""

FALSE_ALARM = 1e-4
"""Probability with which each test below would fail on an estimator without fault."""


@dataclass(frozen=True, eq=False)
class MonteCarlo:
    """Estimates of many runs of one experiment, R runs, p parameters.

    truth, bound : (p,) and (p, p) float64
        true parameters, and the Cramér-Rao bound of their covariance
    least_squares : (p, p) float64
        the same of LS: its theoretical covariance
    wls, ls, wls_std, ls_std : (R, p) float64
        estimates and reported standard errors
    rows : (24,) int
        columns that are rows of Table 2: all but the offsets
    """

    truth: Array
    bound: Array
    least_squares: Array
    wls: Array
    ls: Array
    wls_std: Array
    ls_std: Array
    rows: np.ndarray

    @property
    def runs(self) -> int:
        return len(self.wls)


@pytest.fixture(scope="module")
def paper_arm() -> SimulatedArm:
    return simulate(paper_robot(), seed=2)


def oracle_columns(arm: SimulatedArm, result: Identification) -> list[Array]:
    """Columns of every joint's equation in the order of the identification, (N, p) a joint, by Pinocchio and (9)."""
    exact, structure = arm.exact.exact, result.structure
    phi = pinocchio_regressor(arm.robot, exact.position, exact.velocity, exact.acceleration)
    standard = [f"{name}{link}" for link in (1, 2, 3) for name in STANDARD]
    leading = [standard.index(next(iter(BASE_ROWS[name][0]))) for name in structure.base.expressions]
    grouping = np.zeros((len(leading), len(standard)))
    for row, name in enumerate(structure.base.expressions):
        for term, factor in BASE_ROWS[name][0].items():
            grouping[row, standard.index(term)] = factor
    # The grouping that the paper prints is the one of Pinocchio's columns: Φ = L G.
    np.testing.assert_allclose(phi[:, :, leading] @ grouping, phi, rtol=0, atol=1e-9 * np.abs(phi).max())
    columns = []
    for joint in range(3):
        velocity = exact.velocity[:, joint]
        own = {
            f"stiction joint{joint + 1}": 2 / np.pi * np.arctan(500.0 * velocity),
            f"stribeck joint{joint + 1}": 2 / np.pi * np.arctan(10.0 * velocity),
            f"viscous joint{joint + 1}": velocity,
            f"offset joint{joint + 1}": np.ones_like(velocity),
        }
        friction = [own.get(name, np.zeros_like(velocity)) for name in structure.names[len(leading) :]]
        columns.append(np.column_stack([phi[:, joint, leading], *friction]))
    return columns


def theoretical_covariances(columns: list[Array]) -> tuple[Array, Array]:
    """(LᵀΣ⁻¹L)⁻¹, the Cramér-Rao bound, and (LᵀL)⁻¹ LᵀΣL (LᵀL)⁻¹, what LS has."""
    grams = np.array([matrix.T @ matrix for matrix in columns])
    variance = PAPER_NOISE[:, None, None] ** 2
    bound = np.linalg.inv((grams / variance).sum(axis=0))
    bread = np.linalg.inv(grams.sum(axis=0))
    meat = (grams * variance).sum(axis=0)
    return bound, bread @ meat @ bread


def monte_carlo(arm: SimulatedArm, runs: int) -> MonteCarlo:
    """The same motion again and again with the paper's noise drawn anew; both estimators see the same noise."""
    rng = np.random.default_rng(20210915)
    found: dict[str, list[Array]] = {"wls": [], "ls": [], "wls_std": [], "ls_std": []}
    result = None
    for _ in range(runs):
        recording = arm.recording(arm.white(PAPER_NOISE, rng))
        for estimator in Estimator:
            result = identify(arm.robot, [recording], options=Options(estimator=estimator, prior=False))
            assert result.structure.size == 27, "terms were invented or dropped"
            found[estimator.value].append(result.free_parameters)
            found[f"{estimator.value}_std"].append(standard_errors(result))
    assert result is not None
    bound, least_squares = theoretical_covariances(oracle_columns(arm, result))
    rows = np.flatnonzero([not name.startswith("offset") for name in result.structure.names])
    truth = true_parameters(result, arm.robot)
    return MonteCarlo(truth, bound, least_squares, rows=rows, **{key: np.array(v) for key, v in found.items()})


@pytest.fixture(scope="module", params=[30, pytest.param(200, marks=pytest.mark.proof)])
def experiment(request: pytest.FixtureRequest, paper_arm: SimulatedArm) -> MonteCarlo:
    return monte_carlo(paper_arm, request.param)


def test_all_24_rows_have_the_papers_grouping_and_exact_values(paper_arm: SimulatedArm) -> None:
    found = document(identify(paper_arm.robot, [paper_arm.recording()]))
    assert {entry.name for entry in found.base_parameters} == set(BASE_ROWS)
    exact = dict(zip(BASE_ROWS, EXACT_BASE_VALUES, strict=True))
    for entry in found.base_parameters:
        terms, printed = BASE_ROWS[entry.name]
        assert entry.terms == pytest.approx(terms, abs=1e-9)
        assert entry.independent == (len(terms) == 1)
        assert entry.value == pytest.approx(exact[entry.name], abs=1e-6)
        assert entry.value == pytest.approx(printed, abs=PRINTED)
    for name, values in FRICTION_ROWS.items():
        assert [getattr(entry, name) for entry in found.friction] == pytest.approx(values, abs=1e-6)
    assert [entry.offset for entry in found.friction] == pytest.approx([0.0, 0.0, 0.0], abs=1e-6)
    assert (len(found.base_parameters), found.rotor_inertia, found.undetermined) == (15, [], [])


@pytest.mark.parametrize("seed", range(5))
def test_a_recording_without_noise_is_identified(seed: int) -> None:
    """Here the links' pseudo-inertia lies on the boundary of what can be, and nothing gives the equations a weight."""
    arm = simulate(paper_robot(), seed=seed)
    result = identify(arm.robot, [arm.recording()])
    truth = true_parameters(result, arm.robot)
    np.testing.assert_allclose(result.free_parameters, truth, rtol=0, atol=1e-8)
    np.testing.assert_allclose(result.parameters, truth, rtol=0, atol=1e-6)
    assert result.residuals.fit.relative_error < 1e-8


def test_the_paper_names_the_same_unidentifiable_parameters(paper_arm: SimulatedArm) -> None:
    noise = paper_arm.white(PAPER_NOISE, np.random.default_rng(1))
    found = document(identify(paper_arm.robot, [paper_arm.recording(noise)]))
    assert found.unidentifiable == [f"{name}1" for name in STANDARD if name != "Iyy"]


def test_the_variance_reaches_the_cramer_rao_bound(experiment: MonteCarlo) -> None:
    errors = experiment.wls - experiment.truth
    ratio = np.mean(errors**2, axis=0) / np.diag(experiment.bound)
    least, most = chi_square_range(experiment.runs, FALSE_ALARM / len(experiment.rows))
    assert (ratio[experiment.rows] >= least).all(), ratio
    assert (ratio[experiment.rows] <= most).all(), ratio
    # All directions of parameter space together: Σ eᵀ C⁻¹ e is χ² with R p degrees of freedom.
    distance = np.einsum("ri,ij,rj->", errors, np.linalg.inv(experiment.bound), errors) / errors.size
    least, most = chi_square_range(errors.size, FALSE_ALARM)
    assert least <= distance <= most
    if experiment.runs >= 200:  # only so many runs can tell 10 %
        assert 0.9 <= np.mean(ratio[experiment.rows]) <= 1.1
        assert 0.9 <= distance <= 1.1


def chi_square_range(freedom: int, false_alarm: float) -> tuple[float, float]:
    """Range of χ²/degrees of freedom that is left with this probability."""
    low, high = (float(stats.chi2.ppf(share, freedom)) for share in (false_alarm / 2, 1 - false_alarm / 2))
    return low / freedom, high / freedom


def test_wls_has_no_larger_variance_than_ls_in_any_row(experiment: MonteCarlo) -> None:
    """Where the two are truly alike only the paired comparison can tell: both saw the same noise (Pitman, Morgan)."""
    total = experiment.ls + experiment.wls
    difference = experiment.ls - experiment.wls
    quantile = stats.t.ppf(1 - FALSE_ALARM / len(experiment.rows), experiment.runs - 2)
    for row in experiment.rows:
        # Var LS - Var WLS = cov(LS + WLS, LS - WLS): no row may show it to be negative.
        correlation = np.corrcoef(total[:, row], difference[:, row])[0, 1]
        statistic = correlation * np.sqrt((experiment.runs - 2) / (1 - correlation**2))
        assert statistic > -quantile, f"row {row}: WLS varies more than LS"
    if experiment.runs >= 200:
        variance = [np.var(found[:, experiment.rows], axis=0, ddof=1) for found in (experiment.wls, experiment.ls)]
        assert (variance[0] <= variance[1]).all()


def test_reported_standard_errors_are_those_of_theory(experiment: MonteCarlo) -> None:
    wls, ls = experiment.wls_std[:, experiment.rows], experiment.ls_std[:, experiment.rows]
    assert (wls <= ls * (1.0 + 1e-3)).all(), "WLS reports a larger standard error than LS"
    for reported, covariance in ((wls, experiment.bound), (ls, experiment.least_squares)):
        theory = np.sqrt(np.diag(covariance))[experiment.rows]
        np.testing.assert_allclose(np.median(reported, axis=0), theory, rtol=0.03)


def test_z_scores_have_unit_rms(experiment: MonteCarlo) -> None:
    for estimates, std in ((experiment.wls, experiment.wls_std), (experiment.ls, experiment.ls_std)):
        z = ((estimates - experiment.truth) / std)[:, experiment.rows]
        least, most = chi_square_range(experiment.runs, FALSE_ALARM / z.shape[1])
        assert (np.mean(z**2, axis=0) >= least).all()
        assert (np.mean(z**2, axis=0) <= most).all()
        if experiment.runs >= 200:
            assert 0.9 <= rms(z) <= 1.1


def test_no_estimate_is_biased(experiment: MonteCarlo) -> None:
    bound = stats.norm.ppf(1 - FALSE_ALARM / (2 * len(experiment.rows)))
    for estimates, covariance in ((experiment.wls, experiment.bound), (experiment.ls, experiment.least_squares)):
        bias = np.mean(estimates - experiment.truth, axis=0) * np.sqrt(experiment.runs / np.diag(covariance))
        assert np.abs(bias[experiment.rows]).max() <= bound


def test_one_identification_says_the_same_through_its_document(paper_arm: SimulatedArm) -> None:
    noise = paper_arm.white(PAPER_NOISE, np.random.default_rng(5))
    result = identify(paper_arm.robot, [paper_arm.recording(noise)])
    found = document(result)
    assert [entry.value for entry in found.base_parameters] == list(result.parameters[:15])
    assert [entry.std for entry in found.base_parameters] == list(standard_errors(result)[:15])
    assert np.abs(z_scores(result, paper_arm.robot)).max() < 4.5


def test_on_a_rich_recording_the_prior_changes_nothing(paper_arm: SimulatedArm) -> None:
    """Before bodies restrict it: the paper's links are rods, on the boundary of what can be."""
    noise = paper_arm.white(PAPER_NOISE, np.random.default_rng(0))
    result = identify(paper_arm.robot, [paper_arm.recording(noise)])
    posterior = result.posterior
    std = np.sqrt(np.diag(posterior.covariance))
    assert (np.abs(posterior.mean - result.free_parameters) / std).max() < 0.1
    assert not result.constrained
