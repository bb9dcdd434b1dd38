"""Colours of the page as people see them, those too who lack a kind of cones."""

import re
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from tauscope.server.page.router import STATIC

Colour = NDArray[np.float64]

SIGHT: Mapping[str, Colour] = {
    "all cones": np.eye(3),
    "no long": np.array(
        [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]]
    ),
    "no middle": np.array(
        [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]]
    ),
    "no short": np.array(
        [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]]
    ),
}
"""What is seen of linear sRGB: Machado, Oliveira and Fernandes 2009, table 1, severity 1."""

TO_XYZ = np.array(
    [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750], [0.0193339, 0.1191920, 0.9503041]]
)
"""Of linear sRGB, IEC 61966-2-1; its second row is the luminance."""


def schemes() -> dict[str, dict[str, str]]:
    """Colours of the light and the dark scheme by the names of their CSS variables.

    Dark colours stand twice in the file, for those who chose them and for those whose system did.
    """
    source = (STATIC / "style.css").read_text(encoding="utf-8")
    blocks = [
        dict(re.findall(r"--([\w-]+): (#\w{6});", block)) for block in re.findall(r":root[^{]*\{([^}]*)\}", source)
    ]
    light, dark, chosen = [block for block in blocks if block]
    assert dark == chosen
    assert light.keys() == dark.keys()
    return {"light": light, "dark": dark}


def linear(colour: str) -> Colour:
    """Linear sRGB of #rrggbb, three numbers from 0 to 1.

    Parameters
    ----------
    colour : str
        as CSS writes it
    """
    coded = np.array([int(colour[k : k + 2], 16) / 255.0 for k in (1, 3, 5)])
    return np.where(coded <= 0.04045, coded / 12.92, ((coded + 0.055) / 1.055) ** 2.4)


def contrast(one: str, other: str) -> float:
    """Contrast ratio of two colours, from 1 to 21 (WCAG 2.2).

    Parameters
    ----------
    one, other : str
        as CSS writes them
    """
    dark, light = sorted(float(TO_XYZ[1] @ linear(each)) for each in (one, other))
    return (light + 0.05) / (dark + 0.05)


def lab(colour: str, sight: Colour) -> Colour:
    """Lightness, red against green and yellow against blue (CIE 1976 L*a*b*).

    Parameters
    ----------
    colour : str
        as CSS writes it
    sight : (3, 3) float64
        what is seen of linear sRGB
    """
    seen = np.clip(sight @ linear(colour), 0.0, 1.0)
    share = (TO_XYZ @ seen) / (TO_XYZ @ np.ones(3))
    f = np.where(share > 0.008856, np.cbrt(share), 7.787 * share + 16.0 / 116.0)
    return np.array([116.0 * f[1] - 16.0, 500.0 * (f[0] - f[1]), 200.0 * (f[1] - f[2])])
