"""Whether a window in time holds what is left there: no other motion can say so, but every stretch of its own can."""

import numpy as np

from tauscope.diagnosis.model.term import Term
from tauscope.diagnosis.search.hypothesis import Hypothesis, Laboratory
from tauscope.recording.recording import Array

OPEN = 1e-3  # part of its largest row from which a row of an effect counts as inside its window
CHANCE = 2.0  # standard deviations by which the excess of white rows may be larger by chance
STRETCHES = 12  # parts of a window, at most, by which the standard error of its gain is known…
SHORTEST = 4  # …and rows of each, at least: fewer agree because the effect was fitted to them
FEWEST = 4  # parts below which nothing is known
MOST = 0.5  # part of what exceeds the rows outside that an effect explains inside its window, at least


def window_log_odds(before: Hypothesis, after: Hypothesis, term: Term, laboratory: Laboratory) -> float:
    """2 z² of the gain that the stretches of a window agree on; minus infinity where most of its excess stays.

    They agree where each gains in proportion to the energy of what the effect changes there: a half sine gains most in
    its middle.
    """
    rows, touched = laboratory.rows, term.effect.touched(len(before.scales))
    signals = [after.model.signals(piece) for piece in rows.observations]
    white = rows.columns(term.effect, term.shape[None], signals)
    residuals = [rows.white.residual(each.model) for each in (before, after)]
    gained, excess, gains = 0.0, 0.0, list[Array]()
    for joint in touched:
        strength = np.abs(rows.take(joint, white[joint][0], 1.0)).max(axis=0, initial=0.0)
        inside = strength > OPEN * strength.max(initial=np.finfo(float).tiny)
        if inside.all() or not inside.any():
            continue
        scale = np.exp(2.0 * after.scales[joint].values[0])
        first, second = (rows.take(joint, each[joint], 1.0) ** 2 / scale for each in residuals)
        level = float(second[~inside].mean())
        recording, instants = (each[rows.order[joint]][inside] for each in rows.observations.row_labels(joint))
        ranked = np.empty(len(instants), dtype=np.intp)
        ranked[np.lexsort((instants, recording))] = np.arange(len(instants))
        changed = rows.take(joint, residuals[0][joint] - residuals[1][joint], 1.0) ** 2 / scale
        gain = np.stack([first - second, changed])[:, inside]
        gains.append(gain[:, np.argsort(ranked)])
        gained += float(gain[0].sum())
        excess += float(first[inside].sum()) - level * gain.shape[1]
    lengths = [each.shape[1] for each in gains]
    stretches = min(STRETCHES, min(lengths, default=0) // SHORTEST)
    by_chance = CHANCE * np.sqrt(2.0 * sum(lengths))
    if stretches < FEWEST or gained <= 0.0 or gained < MOST * (excess - by_chance):
        return -np.inf
    sums = np.sum([[part.sum(axis=1) for part in np.array_split(each, stretches, axis=1)] for each in gains], axis=0)
    own, energy = sums.T
    apart = own - own.sum() * energy / energy.sum()
    spread = float(np.sqrt(apart @ apart * stretches / (stretches - 1)))
    return 2.0 * (gained / spread) ** 2 if spread > 0.0 else -np.inf
