"""Rows of a stop: friction there is one unknown value up to breakaway, however long the stop is."""

from itertools import pairwise

import numpy as np
import pytest

from diagnosis.nominal_arm import nominal_rows, stopping
from tauscope.diagnosis.evidence.rows import AROUND_STOP, EvidenceRows, find_rest
from tauscope.diagnosis.evidence.scales import Scales
from tauscope.recording.recording import Array

JOINT = 1
STOPS = slice(40, 90), slice(200, 230)
"""Both are longer than a turning point."""


def certainties(*stops: slice, noise: float = 1.0) -> Array:
    """Weight of every row of the joint beside noise that a model finds, in order of time, (R,)."""
    observations, model = nominal_rows()
    scales = [Scales.start(1.0).without_discrepancy(noise)] * observations.robot.joint_count
    rows = EvidenceRows.prepare(stopping(observations, JOINT, *stops), model).under(model, scales)
    found = np.empty_like(rows.certain[JOINT])
    found[rows.order[JOINT]] = rows.certain[JOINT]
    return found


def test_stops_are_numbered_one_after_another_with_the_rows_that_share_their_samples() -> None:
    observations, model = nominal_rows()
    _, stops = find_rest(stopping(observations, JOINT, *STOPS), model, JOINT)
    widened = [stop.stop - stop.start + 2 * AROUND_STOP for stop in STOPS]
    each = [length for _ in observations for length in widened]
    assert np.bincount(stops)[1:].tolist() == each


def test_no_row_belongs_to_a_stop_where_a_joint_never_stops() -> None:
    observations, model = nominal_rows()
    _, stops = find_rest(stopping(observations, JOINT), model, JOINT)
    assert not stops.any()


@pytest.mark.parametrize("found", [0.3, 1.0])
def test_all_rows_of_a_stop_count_as_one_whose_variance_is_that_of_breakaway(found: float) -> None:
    observations, model = nominal_rows()
    moving, stopped = certainties(noise=found), certainties(*STOPS, noise=found)
    _, stops = find_rest(stopping(observations, JOINT, *STOPS), model, JOINT)
    place = model.structure.coefficient(JOINT, "stiction")
    assert place is not None
    noise = observations.noise[JOINT].model.variance * found**2
    power = 1.0 + model.parameters[place] ** 2 / noise
    for number in range(1, stops.max() + 1):
        share = (stopped[stops == number] / moving[stops == number]) ** 2
        assert share.sum() == pytest.approx(1.0 / power)
    np.testing.assert_array_equal(stopped[stops == 0], moving[stops == 0])
    assert power > 1.0


def test_rows_that_count_as_one_another_tell_less_by_the_root_of_their_number() -> None:
    observations, model = nominal_rows()
    rows = EvidenceRows.prepare(observations, model)
    white = rows.white.measured(JOINT)
    np.testing.assert_allclose(rows.take(JOINT, white, 4.0), rows.take(JOINT, white, 1.0) / 2.0)
    assert rows.measured_rms(JOINT, 4.0) == pytest.approx(rows.measured_rms(JOINT, 1.0) / 2.0)


def test_a_row_that_tells_less_counts_as_a_part_of_one() -> None:
    observations, model = nominal_rows()
    rows = EvidenceRows.prepare(stopping(observations, JOINT, *STOPS), model)
    moments = rows.moments(model, [2.0] * observations.robot.joint_count)
    share = observations.noise[JOINT].share / 2.0
    bounds, certain = rows.bounds[JOINT], rows.certain[JOINT]
    expected = [share * float((certain[first:last] ** 2).sum()) for first, last in pairwise(bounds)]
    np.testing.assert_allclose(moments[JOINT].counts, expected)
