"""Colours that mean something are told apart by everybody, and stand out from the paper."""

from itertools import combinations

import numpy as np
import pytest

from server.http.page_colours import SIGHT, contrast, lab, schemes

APART = 20.0
"""Least distance in L*a*b* of two curves; 2.3 is just noticeable side by side."""

CURVES = {"joints": ("c1", "c2", "c3", "c4"), "models": ("measured", "before", "after")}
HEAT = [f"heat-{level}" for level in range(8)]
STEP = 4.0
"""Least step of lightness from one level of the map to the next."""

TEXT, GRAPHICS = 4.5, 3.0
"""Least contrast that WCAG 2.2 AA asks for, of small text and of what has to be made out."""


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("sight", SIGHT)
def test_curves_and_levels_are_told_apart_without_every_cone(scheme: str, sight: str) -> None:
    colours = schemes()[scheme]
    for names in CURVES.values():
        for one, other in combinations(names, 2):
            distance = np.linalg.norm(lab(colours[one], SIGHT[sight]) - lab(colours[other], SIGHT[sight]))
            assert distance > APART, (one, other)
    lightness = [lab(colours[name], SIGHT[sight])[0] for name in HEAT]
    steps = np.diff(lightness)
    assert np.all(np.abs(steps) > STEP)
    assert np.all(np.sign(steps) == np.sign(steps[0]))


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_curves_and_words_stand_out_from_what_they_are_on(scheme: str) -> None:
    colours = schemes()[scheme]
    for name in (*CURVES["joints"], *CURVES["models"]):
        assert contrast(colours[name], colours["paper"]) > GRAPHICS, name
    for ground in ("paper", "raised", "caution"):
        for name in ("ink", "muted") if ground != "caution" else ("ink",):
            assert contrast(colours[name], colours[ground]) > TEXT, (name, ground)
    for word, ground in (("on-stop", "stop"), ("on-accent", "accent"), ("good", "paper"), ("bad", "paper")):
        assert contrast(colours[word], colours[ground]) > TEXT, (word, ground)
