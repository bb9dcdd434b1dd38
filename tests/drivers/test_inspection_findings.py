"""A failure names its place once, whatever the message of the driver begins with."""

import pytest

from tauscope_drivers.inspection import Finding, Severity, failure

PLACE = "joint 3 (node 9)"


@pytest.mark.parametrize(
    "message",
    [
        "does not answer; check its power",
        "joint 3 (node 9) does not answer; check its power",
        "joint 3 (node 9): does not answer; check its power",
        "node 9: does not answer; check its power",
    ],
)
def test_the_place_is_told_once(message: str) -> None:
    found = failure(PLACE, message, "node 9")
    assert found == Finding(Severity.FAILURE, PLACE, "does not answer", "check its power")


def test_what_only_begins_alike_is_left_as_it_is() -> None:
    assert failure("can0", "the bus can0 is gone; plug it in").detail == "the bus can0 is gone"
    assert failure(PLACE, "node 99: is there too; look", "node 9").detail == "node 99: is there too"
