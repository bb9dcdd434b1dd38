"""The verdict from its evidence, and the smallest visible sizes from theirs."""

import numpy as np
import pytest
from scipy import stats

from tauscope.diagnosis.findings.detectability import Visibility, detectable
from tauscope.diagnosis.findings.verdict import OPEN, Evidence, Verdict, verdict
from tauscope.effects.joint_spring import JointSpring


@pytest.mark.parametrize(
    ("findings", "before", "after", "holds", "expected"),
    [
        (0, False, False, True, Verdict.CONSISTENT),
        (0, False, False, False, Verdict.INCONCLUSIVE),
        (0, True, True, True, Verdict.UNEXPLAINED),
        (0, True, True, False, Verdict.UNEXPLAINED),
        (1, True, False, True, Verdict.EXPLAINED),
        (1, False, False, False, Verdict.EXPLAINED),
        (2, True, True, False, Verdict.PARTLY_EXPLAINED),
    ],
)
def test_each_verdict_follows_from_tests(
    findings: int, before: bool, after: bool, holds: bool, expected: Verdict
) -> None:
    assert verdict(Evidence(findings, before, after, holds)) is expected


def spring(information: float) -> Visibility:
    return Visibility(JointSpring(0), information, 3.0)


def test_a_spring_of_the_smallest_visible_size_is_found_nine_times_in_ten() -> None:
    level = 1e-4
    (size,) = detectable([spring(400.0)], level, 1.0)
    assert size.minimum is not None
    rng = np.random.default_rng(1)
    scores = (size.minimum * 20.0 + rng.standard_normal(20_000)) ** 2
    threshold = stats.chi2.isf(level / 3.0, 1)
    assert np.mean(scores > threshold) == pytest.approx(0.9, abs=0.01)


def test_more_misfit_and_more_shapes_need_a_larger_effect() -> None:
    (plain,), (inflated,) = (detectable([spring(400.0)], 1e-4, factor) for factor in (1.0, 4.0))
    assert plain.minimum is not None
    assert inflated.minimum == pytest.approx(2.0 * plain.minimum)
    assert spring(1.0).needed_strength(1e-6) > spring(1.0).needed_strength(1e-3)


def test_what_lies_within_the_nominal_columns_is_not_visible() -> None:
    (size,) = detectable([spring(0.0)], 1e-4, 1.0)
    assert not size.visible
    assert size.minimum is None


def test_a_model_that_predicts_nothing_is_not_consistent() -> None:
    """However little it leaves of slow training motion, and however well its parameters hold there."""
    quiet = Evidence(0, misfit_before=False, misfit_after=False, parameters_hold=True, predicts=False)
    assert verdict(quiet) is Verdict.INCONCLUSIVE


@pytest.mark.parametrize(
    ("evidence", "expected"),
    [
        (Evidence(0, True, True, True, predicts=False, extrapolates=True), Verdict.INCONCLUSIVE),
        (Evidence(0, True, True, True, predicts=True, extrapolates=True), Verdict.UNEXPLAINED),
        (Evidence(0, True, True, True, predicts=False), Verdict.UNEXPLAINED),
        (Evidence(0, False, False, True, predicts=True, extrapolates=True), Verdict.CONSISTENT),
        (Evidence(1, True, False, True, predicts=False, extrapolates=True), Verdict.EXPLAINED),
        (Evidence(1, True, False, True, predicts=False, undetermined=True), Verdict.INCONCLUSIVE),
        (Evidence(1, True, False, True, predicts=True, undetermined=True), Verdict.EXPLAINED),
    ],
)
def test_motion_beyond_training_decides_only_what_is_badly_predicted_and_has_no_name(
    evidence: Evidence, expected: Verdict
) -> None:
    assert verdict(evidence) is expected


@pytest.mark.parametrize(
    ("evidence", "expected"),
    [
        (Evidence(0, False, False, True, wrong_values=True), Verdict.WRONG_VALUES),
        (Evidence(1, True, False, True, wrong_values=True), Verdict.EXPLAINED),
        (Evidence(0, True, True, True, wrong_values=True), Verdict.UNEXPLAINED),
        (Evidence(0, False, False, False, wrong_values=True), Verdict.INCONCLUSIVE),
    ],
)
def test_wrong_values_are_the_verdict_where_no_physics_is_missing(evidence: Evidence, expected: Verdict) -> None:
    assert verdict(evidence) is expected


def test_a_verdict_that_leaves_something_open_asks_for_another_motion() -> None:
    closed = {Verdict.CONSISTENT, Verdict.EXPLAINED, Verdict.WRONG_VALUES}
    assert set(Verdict) - closed == OPEN
