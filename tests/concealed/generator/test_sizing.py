"""The size of a wanted strength is found where there is one, and where there is none, the nearest."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from concealed.generator import sizing
from concealed.generator.effects import Drawn
from concealed.generator.sizing import CLOSE_ENOUGH, tuned


def knob(power: float = 1.0, largest: float = math.inf) -> Drawn:
    return Drawn(lambda size: {"size": size}, 1.0, power, (0,), ("any",), largest=largest)


@given(slope=st.floats(0.1, 1e3), power=st.sampled_from([0.7, 1.0, 2.0]), sign=st.sampled_from([-1.0, 1.0]))
def test_a_power_law_is_inverted(slope: float, power: float, sign: float) -> None:
    size, found = tuned(lambda size: slope * abs(size) ** power, 40.0, sign, knob(power))
    assert found == pytest.approx(slope * abs(size) ** power)
    assert found == pytest.approx(40.0, rel=CLOSE_ENOUGH)
    assert size * sign > 0.0


def test_at_a_bound_it_looks_no_further() -> None:
    looks: list[float] = []

    def shown(size: float) -> float:
        looks.append(size)
        return size

    assert tuned(shown, 40.0, 1.0, knob(largest=5.0)) == (5.0, 5.0)
    assert looks == [1.0, 5.0]


def test_what_has_to_be_simulated_is_simulated_whole_only_at_its_size(monkeypatch: pytest.MonkeyPatch) -> None:
    played: list[tuple[float, str]] = []

    def passage(robot: object, entries: list[dict[str, float]], motion: object) -> tuple[float, str]:
        if entries:
            played.append((entries[0]["size"], motion.name))  # type: ignore[attr-defined]
        return entries[0]["size"] if entries else 0.0, motion.name  # type: ignore[attr-defined]

    monkeypatch.setattr(sizing, "passage", passage)
    monkeypatch.setattr(sizing, "foreseen_strength", lambda *_: None)
    # Every motion shows the same per second, so that three show more than one by the root of their time.
    monkeypatch.setattr(
        sizing, "strength", lambda robot, entries, made, noise: (made[0][0] * (1.0 if len(made) == 1 else 1.66), None)
    )
    entry, found = sizing.sized("paper", knob(), 40.0, 0)
    assert found == pytest.approx(40.0, rel=CLOSE_ENOUGH)
    whole = [size for size, motion in played if motion == "train3"]
    assert whole == [entry["size"]]
