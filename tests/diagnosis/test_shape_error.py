"""What a finding is beside a larger one at its joint: by its share; a wrong gain beside load friction, in any case."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from concealed.sealing.sealed import made
from tauscope.diagnosis import diagnose, document
from tauscope.diagnosis.selection import shape_error
from tauscope.diagnosis.selection.shape_error import EFFICIENCY, SHAPE_ERROR, Standing, standings
from tauscope.effects import Effect
from tauscope.effects.asymmetric_coulomb import AsymmetricCoulomb
from tauscope.effects.load_dependent_friction import LoadDependentFriction
from tauscope.effects.torque_gain_error import TorqueGainError

EXPLAINED = 1000.0


def beside(
    monkeypatch: pytest.MonkeyPatch, effects: list[Effect], shares: list[float], alone: list[float]
) -> list[Standing]:
    """Standings at one joint where effects explain `EXPLAINED`, with what each adds to the rest and explains alone."""
    explains = {effect.id: np.array([EXPLAINED * part]) for effect, part in zip(effects, alone, strict=True)}
    monkeypatch.setattr(shape_error, "_alone", lambda places, nominal, fit, fitter: explains[effects[places[0]].id])
    model = SimpleNamespace(terms=[SimpleNamespace(effect=effect) for effect in effects])
    fit: Any = SimpleNamespace(
        model=model, projection=SimpleNamespace(residual=[np.zeros(1)]), joint_energies=np.array([100.0])
    )
    nominal: Any = SimpleNamespace(joint_energies=fit.joint_energies + EXPLAINED)
    without: Any = [SimpleNamespace(joint_energies=fit.joint_energies + EXPLAINED * share) for share in shares]
    unused: Any = None
    return standings(nominal, fit, without, unused, 1.0)


def test_a_small_share_is_doubted_and_the_larger_effect_is_not(monkeypatch: pytest.MonkeyPatch) -> None:
    friction, asymmetric = LoadDependentFriction(0), AsymmetricCoulomb(0)
    large, small = beside(monkeypatch, [friction, asymmetric], [0.9, 0.1], [0.9, 0.2])
    assert large.certainty == 1.0
    assert small.behind is friction
    assert small.certainty == pytest.approx(0.1**2 / (0.1**2 + SHAPE_ERROR**2))


@pytest.mark.parametrize("leads", [True, False])
def test_a_wrong_gain_beside_load_friction_may_be_a_gears_efficiency(
    monkeypatch: pytest.MonkeyPatch, leads: bool
) -> None:
    friction, gain = LoadDependentFriction(0), TorqueGainError(0)
    alone = [0.5, 0.6] if leads else [0.6, 0.5]
    found = beside(monkeypatch, [friction, gain], [0.4, 0.4], alone)
    assert found[1].behind is friction
    assert found[1].certainty == pytest.approx(0.4**2 / (0.4**2 + EFFICIENCY**2))


def test_beside_anything_else_it_is_what_it_explains(monkeypatch: pytest.MonkeyPatch) -> None:
    other, gain = AsymmetricCoulomb(0), TorqueGainError(0)
    assert beside(monkeypatch, [other, gain], [0.4, 0.4], [0.5, 0.6])[1].certainty == 1.0


@pytest.mark.slow
def test_load_friction_that_grows_with_the_square_of_the_load_is_no_certain_gain_error() -> None:
    _, trial = made("form", 13000002)
    found = {each.effect: each for each in document(diagnose(trial.robot, trial.train, trial.held_out)).findings}
    assert found["load_dependent_friction"].probability > 0.9
    assert found["torque_gain_error"].probability < 0.6
    assert "A gear's efficiency, or load friction of another formula, may look the same" in (
        found["torque_gain_error"].statement
    )
