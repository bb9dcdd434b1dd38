"""Windows screened on whitened rows against the exact columns of each, one after another."""

import numpy as np
import pytest
from scipy import stats

from diagnosis.diagnosed_arm import recordings
from identification.simulated import paper_robot
from tauscope.diagnosis.fitting.fit import Fit, Fitter
from tauscope.diagnosis.fitting.projection import moments, statistics
from tauscope.diagnosis.model.nominal import nominal_model, setting_of
from tauscope.diagnosis.noise.floor import with_noise
from tauscope.diagnosis.observations.observations import Observations
from tauscope.diagnosis.screening.screen import Screen, model_signals
from tauscope.diagnosis.screening.windows import white_torque, windowed_moments, windows_on_rows, windows_tried
from tauscope.effects import Signals, TimeLocalEffect, possible_effects
from tauscope.identification import identify
from tauscope.recording.conditioning import Conditioner


@pytest.fixture(scope="module")
def fitted() -> tuple[Screen, Fit, list[Signals], list[TimeLocalEffect]]:
    robot = paper_robot()
    made = recordings((1, 2), None, np.random.default_rng(3))
    identification = identify(robot, made)
    model = nominal_model(identification)
    conditioners = [Conditioner.survey(each, robot) for each in made]
    base = identification.structure.base
    rows = Observations.prepare(conditioners, robot, base, 8.0, model.steepness)
    setting = setting_of(model, rows, conditioners, 8.0)
    effects = [each for each in possible_effects(setting) if isinstance(each, TimeLocalEffect)]
    rows, _ = with_noise(rows, model, effects)
    fit = Fitter(rows).fit(model)
    return Screen(rows, effects), fit, model_signals(fit.model, rows), effects


def test_windows_on_rows_see_what_exact_columns_see(
    fitted: tuple[Screen, Fit, list[Signals], list[TimeLocalEffect]],
) -> None:
    screen, fit, signals, effects = fitted
    rng = np.random.default_rng(0)
    for effect in effects:
        picked = rng.choice(np.flatnonzero(effect.grid[:, 2] - effect.grid[:, 1] != 0.5), 12, replace=False)
        exact = moments(fit.projection, screen.white_columns(effect, effect.grid[picked], signals))
        windows = windows_on_rows(effect, screen.observations)
        quick = windowed_moments(white_torque(effect, screen.observations, signals), windows, fit)
        energies = np.einsum("gcc->gc", quick.gram)[picked], np.einsum("gcc->gc", exact.gram)
        shown = energies[1] > 1e-3 * energies[1].max()
        assert energies[0][shown] == pytest.approx(energies[1][shown], rel=0.3)
        gains = statistics(exact, [False] * len(effect.coefficients))[0]
        found = statistics(quick, [False] * len(effect.coefficients))[0][picked]
        assert np.abs(found - gains).max() < 0.5 * np.sqrt(gains.max()) + 3.0


def test_the_largest_of_all_windows_is_as_large_as_their_number_says(
    fitted: tuple[Screen, Fit, list[Signals], list[TimeLocalEffect]],
) -> None:
    """Many draws of noise at every row: the share beyond the threshold of a 5 % level is 5 %."""
    screen, fit, signals, effects = fitted
    effect = next(each for each in effects if each.joint == 1)
    windows = windows_on_rows(effect, screen.observations)
    white = white_torque(effect, screen.observations, signals)
    found = windowed_moments(white, windows, fit)
    seen = found.gram[:, 0, 0] > 0.0
    number = windows_tried(found, white, windows, fit, np.random.default_rng(1))
    assert 10.0 < number < len(effect.grid)
    threshold = stats.chi2.isf(0.05 / number, 1)
    rng, beyond = np.random.default_rng(2), 0
    basis = np.concatenate(fit.projection.basis, axis=1)
    sizes = np.cumsum([each.shape[1] for each in fit.projection.basis])[:-1]
    for _ in range(400):
        noise = rng.standard_normal(basis.shape[1])
        left = np.split(noise - (basis @ noise) @ basis, sizes)[1]
        score = windows[1] @ (white[1][0] * left)
        beyond += bool((score[seen] ** 2 / found.gram[seen, 0, 0]).max() > threshold)
    assert 6 <= beyond <= 38  # 400 draws of 5 %: 20 ± 4.4
