"""The size of a finding beside the concealed one, by the names that the contract gives its parameters."""

from collections.abc import Mapping
from typing import Any

import numpy as np

SIZES: Mapping[str, tuple[str, ...]] = {
    "spring": ("k",),
    "cable": ("k",),
    "load_friction": ("mu",),
    "asymmetric_coulomb": ("a",),
    "asymmetric_viscous": ("b",),
    "nonlinear_viscous": ("c",),
    "position_friction": ("a", "b"),
    "bristles": ("F",),
    "drift": ("f",),
    "coupling": ("f",),
    "gain_joint": ("g",),
    "sign_joint": ("g",),
    "sign_all": ("g",),
    "delay_joint": ("d",),
    "delay_all": ("d",),
    "saturation": ("c",),
    "payload_change": ("m",),
    "contact": ("F_x", "F_y", "F_z"),
    "gravity": ("alpha_1", "alpha_2"),
}
"""Parameters whose length, or whose value where there is one, is the size."""

TRUTH: Mapping[str, str] = {"position_friction": "amplitude", "contact": "force", "gravity": "tilt"}
"""Name of the concealed size where it is a length."""

WAVES = ("cogging", "ripple")
POWER = 0.25
"""Exponents closer than so have a coefficient of the same meaning: half a step of those that a catalogue has."""


def has_order(finding: Mapping[str, Any], concealed: Mapping[str, Any]) -> bool:
    """Whether one of a finding's waves is the concealed one, as far as the range tells orders apart."""
    if concealed["kind"] not in WAVES:
        return True
    return _wave(finding, concealed) is not None


def found_size(finding: Mapping[str, Any], concealed: Mapping[str, Any]) -> tuple[float, float, float] | None:
    """Found size, its standard error, and the size that the trial holds; None where they are of different things."""
    kind, truth = concealed["kind"], concealed["total"]
    values = {each["name"]: (float(each["value"]), float(each["std"])) for each in finding["parameters"]}
    if kind in WAVES:
        suffix = _wave(finding, concealed)
        amplitude = None if suffix is None else values.get(f"amplitude{suffix}")
        return None if amplitude is None else (*amplitude, abs(truth["amplitude"]))
    if kind not in SIZES or any(name not in values for name in SIZES[kind]):
        return None
    if "p" in truth and "p" in values and abs(values["p"][0] - truth["p"]) > POWER:
        return None
    parts = np.array([values[name] for name in SIZES[kind]])
    if len(parts) == 1:
        return float(parts[0, 0]), float(parts[0, 1]), float(truth[SIZES[kind][0]])
    length = float(np.linalg.norm(parts[:, 0]))
    std = float(np.linalg.norm(parts[:, 0] * parts[:, 1])) / max(length, 1e-300)
    return length, std, abs(float(truth[TRUTH[kind]]))


def _wave(finding: Mapping[str, Any], concealed: Mapping[str, Any]) -> str | None:
    """Ending of the parameters of the wave with the concealed order."""
    half = 0.5 * float(concealed["constants"]["resolution"])
    for each in finding["parameters"]:
        if each["name"].startswith("order") and abs(float(each["value"]) - concealed["total"]["order"]) <= half:
            return str(each["name"].removeprefix("order"))
    return None
