"""Optional columns are looked for by name: a long recording without them is not read."""

import numpy as np
import pytest

from tauscope.recording import EffortKind, Recording
from tauscope.recording.link_encoders import link_warnings
from tauscope.recording.samples import Array
from tauscope.robot import JointType


class UnreadTable:
    """Names of columns whose rows nobody may ask for."""

    names = ("t", "q1", "tau1", "qd1")

    def __len__(self) -> int:
        return 10

    def rows(self, start: int, stop: int) -> Array:
        raise AssertionError(f"rows {start}:{stop} were read")


@pytest.fixture
def unread() -> Recording:
    return Recording("long", 1, EffortKind.TORQUE, UnreadTable())


def test_columns_are_found_by_their_group(unread: Recording) -> None:
    assert unread.has("qd")
    assert not unread.has("qdd")
    assert not unread.has("qlink")
    instants = np.arange(12.0)
    assert Recording.from_arrays(
        "linked", instants, instants[:, None], instants[:, None], link_position=instants[:, None]
    ).has("qlink")


def test_a_recording_without_link_encoders_is_not_read(unread: Recording) -> None:
    assert link_warnings(unread, [JointType.REVOLUTE], ["joint1"]) == []
