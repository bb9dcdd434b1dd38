"""Torque = regressor × parameters: the regressor, base parameters, rigid-body dynamics and friction columns."""

from tauscope.dynamics.base_parameters import BaseParameters, base_parameters
from tauscope.dynamics.friction import friction_torque, smooth_sign, smooth_sign_slope
from tauscope.dynamics.regressor import torque_regressor
from tauscope.dynamics.rigid_body import gravity_torque, inverse_dynamics, mass_matrix

__all__ = [
    "BaseParameters",
    "base_parameters",
    "friction_torque",
    "gravity_torque",
    "inverse_dynamics",
    "mass_matrix",
    "smooth_sign",
    "smooth_sign_slope",
    "torque_regressor",
]
