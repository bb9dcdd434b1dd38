"""Orders elsewhere that explain as much widen the interval, those that do not leave it alone."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from identification.simulated import Array
from tauscope.diagnosis.findings import order_spread
from tauscope.diagnosis.findings.elsewhere import Elsewhere, spread
from tauscope.diagnosis.findings.order_spread import orders_elsewhere
from tauscope.diagnosis.fitting.projection import Moments
from tauscope.diagnosis.model.term import Term
from tauscope.effects import Effect, Quantity
from tauscope.effects.periodic_torque import Cogging
from tauscope.effects.torque_saturation import Clipping

ERROR = 0.2
WITHOUT: Any = SimpleNamespace(model=None)


def found_at(
    monkeypatch: pytest.MonkeyPatch, effect: Effect, at: float, peaks: dict[float, float], inflation: float = 1.0
) -> tuple[Elsewhere, ...]:
    """What is elsewhere, where an effect explains T(s) = max (height - (s - peak)²/ERROR²)."""

    def at_shapes(effect: Effect, shapes: Array, *_: Any) -> Moments:
        falls = [inflation * (shapes[:, 0] - peak) ** 2 / ERROR**2 for peak in peaks]
        gains = np.max([height - fall for height, fall in zip(peaks.values(), falls, strict=True)], axis=0)
        target = np.stack([np.sqrt(np.maximum(gains, 0.0)), np.zeros(len(gains))], axis=1)
        return Moments(target, np.tile(np.eye(2), (len(gains), 1, 1)), np.ones((len(gains), 2)), target)

    monkeypatch.setattr(order_spread, "model_signals", lambda *_: None)
    screen: Any = SimpleNamespace(at_shapes=at_shapes, observations=None)
    term = Term(effect, np.array([at]), np.array([10.0, 0.0]))
    return orders_elsewhere(term, ERROR, WITHOUT, screen, inflation)


def waves(*, geared: bool = False) -> Cogging:
    orders = np.arange(1.0, 10.0, 0.5)
    return Cogging(0, orders[:, None], orders[:1], orders[-1:], geared=geared)


@pytest.mark.parametrize(("height", "inflation", "chance"), [(100.0, 1.0, 0.5), (96.0, 1.0, 0.119), (96.0, 4.0, 0.378)])
def test_another_peak_has_the_chance_of_its_likelihood(
    monkeypatch: pytest.MonkeyPatch, height: float, inflation: float, chance: float
) -> None:
    """1 : exp(-Δ/2κ), as both are as wide; what is left of the first beyond three errors is elsewhere too."""
    elsewhere = found_at(monkeypatch, waves(), 3.0, {3.0: 100.0, 7.0: height}, inflation)
    assert sum(each.chance for each in elsewhere) == pytest.approx(chance, rel=0.02)
    assert np.average(
        [each.term.shape[0] for each in elsewhere], weights=[each.chance for each in elsewhere]
    ) == pytest.approx(7.0, abs=0.1)


def test_a_single_peak_or_orders_that_are_known_leave_nothing_elsewhere(monkeypatch: pytest.MonkeyPatch) -> None:
    single = found_at(monkeypatch, waves(), 3.0, {3.0: 100.0, 7.0: 50.0})
    assert sum(each.chance for each in single) < 0.02
    assert found_at(monkeypatch, waves(geared=True), 3.0, {3.0: 100.0, 7.0: 100.0}) == ()


def test_what_is_no_wave_has_nothing_elsewhere(monkeypatch: pytest.MonkeyPatch) -> None:
    """The likelihood of a limit that clips has a kink there and a plateau beyond: no second optimum."""
    clips = Clipping(0, np.arange(1.0, 10.0, 0.5)[:, None], np.array([1.0]), np.array([9.5]))
    assert found_at(monkeypatch, clips, 3.0, {3.0: 100.0, 7.0: 100.0}) == ()


def test_the_spread_is_that_of_all_values_and_a_phase_takes_the_shorter_way() -> None:
    here = Quantity("k", 3.0, 0.2, "1"), Quantity("phase", np.pi - 0.1, 0.05, "rad", period=2.0 * np.pi)
    there = Quantity("k", 7.0, 0.2, "1"), Quantity("phase", -np.pi + 0.1, 0.05, "rad", period=2.0 * np.pi)
    order, phase = spread(here, [(0.25, there), (0.25, there)])
    assert order.std == pytest.approx(np.hypot(0.2, np.sqrt(0.5) * 4.0))
    assert phase.std == pytest.approx(np.hypot(0.05, np.sqrt(0.5) * 0.2))
    assert spread(here, []) == here
