"""What has changed between two identifications, against figures that are worked out by hand."""

import math
from datetime import timedelta

import pytest

from identified import identified
from tauscope.server.history.drift import (
    Drift,
    compute_drift,
    describe_drift,
    duration_words,
    extract_parameters,
    find_largest_by_joint,
    is_beyond,
)
from tauscope.server.history.gates import ModelPolicy


def drifts(before: dict[str, float], after: dict[str, float], **changes: float) -> dict[str, Drift]:
    pair = (extract_parameters(identified(given, **changes)) for given in (before, after))
    return {drift.name: drift for drift in compute_drift(*pair)}


def test_a_difference_in_joint_standard_errors() -> None:
    std = {"friction__0__std__viscous": 0.03}
    found = drifts({"viscous": 0.5}, {"viscous": 0.7}, **std)["viscous shoulder"]
    assert found.joint == "shoulder"
    assert (found.before, found.after) == (0.5, 0.7)
    assert found.std == pytest.approx(0.03 * math.sqrt(2))
    assert found.in_std == pytest.approx(0.2 / (0.03 * math.sqrt(2)))
    assert found.share == pytest.approx(0.4)


def test_what_does_not_change_has_no_drift() -> None:
    same = drifts({}, {})
    assert {"stiction shoulder", "viscous shoulder", "offset shoulder", "m1 + 3.33333*msx1"} <= set(same)
    assert all(drift.in_std == drift.share == 0.0 for drift in same.values())


def test_an_offset_next_to_nothing_is_measured_by_the_dry_friction() -> None:
    given = {"stiction": 1.0, "stribeck": -0.25}
    found = drifts({**given, "offset": 0.001}, {**given, "offset": 0.051}, friction__0__std__offset=1e-4)
    assert found["offset shoulder"].share == pytest.approx(0.05 / 1.25)
    assert found["offset shoulder"].in_std > 300
    assert not is_beyond(found["offset shoulder"], ModelPolicy())


@pytest.mark.parametrize(
    ("after", "std", "beyond"),
    [(0.7, 0.01, True), (0.7, 0.05, False), (0.55, 0.001, False), (0.3, 0.01, True)],
    ids=["large and sure", "large but unsure", "sure but small", "less friction"],
)
def test_only_what_is_large_and_sure_is_told(after: float, std: float, beyond: bool) -> None:
    found = drifts({"viscous": 0.5}, {"viscous": after}, friction__0__std__viscous=std)["viscous shoulder"]
    assert is_beyond(found, ModelPolicy()) is beyond


def test_what_the_recordings_do_not_tell_is_not_compared() -> None:
    silent = identified(friction__0__std={"stiction": 0.01, "viscous": None}, base_parameters__0__std=None)
    unknown = identified(friction__0__identifiable={"viscous": False})
    names = {parameter.name for parameter in extract_parameters(silent)}
    assert "viscous shoulder" not in names
    assert "stiction shoulder" in names
    assert identified().base_parameters[0].name not in names
    assert "viscous shoulder" not in {parameter.name for parameter in extract_parameters(unknown)}
    assert "viscous shoulder" not in {
        drift.name for drift in compute_drift(extract_parameters(identified()), extract_parameters(silent))
    }


def test_the_most_significant_change_of_a_joint() -> None:
    found = drifts({"viscous": 0.5, "stiction": 1.0}, {"viscous": 0.4, "stiction": 1.1}, friction__0__std__viscous=1e-3)
    assert find_largest_by_joint(list(found.values()))["shoulder"].name == "viscous shoulder"


def test_a_base_parameter_belongs_to_the_joint_that_moves_its_first_link() -> None:
    document = identified(joints=["a", "b", "c"], base_parameters__0__terms={"Iyy3": 1.0, "m1": 2.0})
    assert extract_parameters(document)[0].joint == "c"


def test_a_drift_in_words() -> None:
    found = drifts({"viscous": 0.5}, {"viscous": 0.7}, friction__0__std__viscous=0.01)["viscous shoulder"]
    words = "shoulder: viscous friction +40 % in 6 weeks (0.5 → 0.7, 14 standard errors)"
    assert describe_drift(found, timedelta(weeks=6)) == words
    given = {"stiction": 1.0, "stribeck": 0.0}
    offset = drifts({**given, "offset": 0.01}, {**given, "offset": 0.6}, friction__0__std__offset=0.01)[
        "offset shoulder"
    ]
    assert describe_drift(offset, timedelta(days=1)).startswith("shoulder: torque offset in 24 hours (0.01 → 0.6, ")


@pytest.mark.parametrize(
    ("elapsed", "words"),
    [
        (timedelta(hours=1), "1 hour"),
        (timedelta(days=1.9), "46 hours"),
        (timedelta(days=13), "13 days"),
        (timedelta(days=14), "2 weeks"),
        (timedelta(days=100), "3 months"),
    ],
)
def test_lengths_of_time(elapsed: timedelta, words: str) -> None:
    assert duration_words(elapsed) == words
