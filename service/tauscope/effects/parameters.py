"""The parameters of an effect: linear coefficients, what shapes its columns, and both as a finding reports them."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Coefficient:
    """A linear coefficient of an effect."""

    name: str
    unit: str
    positive: bool = False
    largest: float = np.inf
    smallest: float = 0.0


@dataclass(frozen=True)
class Shape:
    """A quantity that shapes an effect's columns and is searched over a grid, then refined between bounds."""

    name: str
    unit: str
    logarithmic: bool = False
    fixed: bool = False
    reported: bool = True


@dataclass(frozen=True)
class Quantity:
    """A parameter as a finding reports it."""

    name: str
    value: float
    std: float
    unit: str
    period: float = np.inf
