"""The parameters of an effect: linear coefficients, what shapes its columns, and both as a finding reports them."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Coefficient:
    """A linear coefficient of an effect.

    name : str
        in the equation
    unit : str
        with ``{tau}`` and ``{q}`` in place of the joint's units of torque and position
    positive : bool
        whether physics allows no negative value
    largest : float
        magnitude beyond which nothing real has it
    smallest : float
        magnitude below which it stands for something else
    """

    name: str
    unit: str
    positive: bool = False
    largest: float = np.inf
    smallest: float = 0.0


@dataclass(frozen=True)
class Shape:
    """A quantity that shapes an effect's columns and is searched over a grid, then refined between bounds.

    name : str
        in the equation
    unit : str
        as in `Coefficient`
    logarithmic : bool
        whether steps are relative ones
    fixed : bool
        whether only the grid's own values make sense
    reported : bool
        whether it belongs to the effect and not merely to how its column is made
    """

    name: str
    unit: str
    logarithmic: bool = False
    fixed: bool = False
    reported: bool = True


@dataclass(frozen=True)
class Quantity:
    """A parameter as a finding reports it.

    name : str
        in the equation
    value : float
        estimate
    std : float
        its standard error
    unit : str
        SI
    period : float
        after which it is the same again; infinite for most
    """

    name: str
    value: float
    std: float
    unit: str
    period: float = np.inf
