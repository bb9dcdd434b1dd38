"""The extended model for the simulated arm: a robot file with what was identified, a scenario with what was found.

Both in the forms that users write themselves, so that `tauscope run --backend sim` plays them. What a scenario cannot
say is a comment in it, never left out silently.
"""

import io
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from ruamel.yaml import YAML

from tauscope.diagnosis.extended_model.consistent_links import consistent_links
from tauscope.diagnosis.findings.diagnosed import Diagnosis
from tauscope.diagnosis.model.term import Term
from tauscope.diagnosis.model.torque_scale import on_the_arm
from tauscope.effects.time_local import EVERY, HALF_SINE
from tauscope.effects.torque_sensing import Clipping
from tauscope.robot import LinkInertia

Entry = dict[str, Any]

INERTIA = ("xx", "yy", "zz", "xy", "xz", "yz")


def improved_robot(diagnosis: Diagnosis, source: Path, target: Path) -> str:
    """The robot file with the identified links, friction and shapes of friction in place of its own."""
    yaml = YAML(typ="rt")
    yaml.width = 4096
    data = yaml.load(source.read_text(encoding="utf-8"))
    urdf = data["kinematics"].get("urdf")
    if urdf is not None and not Path(urdf["file"]).is_absolute():
        urdf["file"] = os.path.relpath(source.parent / urdf["file"], target.parent)
    model = diagnosis.selection.fit.model
    values = dict(zip(model.structure.names, map(float, model.parameters), strict=True))
    friction: list[Entry] = []
    joints: list[Entry] = data.setdefault("joints", [])
    for joint, terms in zip(diagnosis.robot.joints, model.structure.terms, strict=True):
        stribeck = values.get(f"stribeck {joint.name}", 0.0)
        own = {name: values[f"{name} {joint.name}"] for name in ("stiction", "viscous")}
        friction.append({"stiction": own["stiction"], "stribeck": stribeck, "viscous": own["viscous"]})
        entry: Entry | None = next((each for each in joints if each["name"] == joint.name), None)
        if entry is None:  # a URDF's joints need no entry
            joints.append(entry := {"name": joint.name})
        entry["friction_shape"] = {"k_v": float(terms.k_v)}
        entry["friction_shape"]["delta"] = float(terms.delta if terms.delta is not None else 10.0)
    links = consistent_links(diagnosis)
    data["model"] = {"links": [_link(link) for link in links], "friction": friction}
    text = io.StringIO()
    yaml.dump(data, text)
    return text.getvalue()


def scenario_text(diagnosis: Diagnosis) -> str:
    """The findings as a scenario file, beside the robot file of `improved_robot`."""
    model = diagnosis.selection.fit.model
    joints = [joint.name for joint in diagnosis.robot.joints]
    values = dict(zip(model.structure.names, map(float, model.parameters), strict=True))
    entries: list[Entry] = [
        {"effect": "torque_offset", "joint": number, "torque": values[f"offset {name}"]}
        for number, name in enumerate(joints, start=1)
    ]
    remarks = []
    for term in model.terms:
        found = _entries(term, diagnosis)
        entries += found
        if not found:
            remarks.append(f"# {term.effect.name(joints)}: no scenario says this; see the saved model\n")
    text = io.StringIO()
    YAML(typ="safe").dump({"effects": entries}, text)
    return f"# What {diagnosis.robot.name}'s recordings show beyond rigid bodies and plain friction.\n" + "".join(
        [*remarks, text.getvalue()]
    )


def _link(link: LinkInertia) -> Mapping[str, Any]:
    vector = [float(value) for value in link.to_vector()]
    xx, yy, zz, xy, xz, yz, mass, *moment = vector
    return {
        "mass": mass,
        "first_moment": moment,
        "inertia": dict(zip(INERTIA, (xx, yy, zz, xy, xz, yz), strict=True)),
    }


def _entries(term: Term, diagnosis: Diagnosis) -> list[Entry]:
    """A term as entries of a scenario, in the arm's own torque; none where there is no such entry."""
    term = on_the_arm(diagnosis.selection.fit.model, term)
    effect = term.effect
    make = ENTRIES.get(effect.id)
    shape = [float(value) for value in term.shape]
    coefficients = [float(value) for value in term.coefficients]
    made = [] if make is None else make(term, shape, coefficients, diagnosis)
    place = {} if effect.joint is None else {"joint": effect.joint + 1}
    return [{"effect": entry.pop("effect", effect.id), **place, **entry} for entry in made]


def _wave(term: Term, shape: Sequence[float], own: Sequence[float], diagnosis: Diagnosis) -> list[Entry]:
    turning = diagnosis.robot.joints[term.effect.joint or 0].type.value == "revolute"
    order = shape[0] if turning else shape[0] / (2.0 * np.pi)
    return [{"amplitude": float(np.hypot(own[0], own[1])), "order": order, "phase": float(np.arctan2(own[1], own[0]))}]


def _coupling(term: Term, shape: Sequence[float], own: Sequence[float], diagnosis: Diagnosis) -> list[Entry]:
    partner, sign = getattr(term.effect, "partner", 0), getattr(term.effect, "sign", 1)
    of = "sum" if sign > 0 else "difference"
    return [{"other_joint": partner + 1, "of": of, "coulomb": own[0], "viscous": own[1], "k_v": shape[0]}]


def _tilt(term: Term, shape: Sequence[float], own: Sequence[float], diagnosis: Diagnosis) -> list[Entry]:
    """For gravity along -z: R_x(α) R_y(β) (0, 0, -g) is g (-β, α, -1) to first order."""
    gravity = diagnosis.robot.gravity
    if gravity[2] >= 0.0 or np.abs(gravity[:2]).max() > 0.0:
        return []
    return [{"about_x": own[1], "about_y": -own[0]}]


def _contact(term: Term, shape: Sequence[float], own: Sequence[float], diagnosis: Diagnosis) -> list[Entry]:
    """Only what happens in every recording: a scenario is played from its beginning each time."""
    if shape[0] != EVERY:
        return []
    profile = "half_sine" if shape[3] == HALF_SINE else "rectangular"
    window = {"start": max(shape[1], 0.0), "duration": shape[2] - shape[1], "profile": profile}
    return [{"force": list(own), **window} if term.effect.joint is None else {"torque": own[0], **window}]


def _payload_change(term: Term, shape: Sequence[float], own: Sequence[float], diagnosis: Diagnosis) -> list[Entry]:
    if shape[0] != EVERY or own[0] <= 0.0:
        return []
    return [{"mass": own[0], "offset": list(shape[4:7]), "start": shape[1], "end": shape[2]}]


def _saturation(term: Term, shape: Sequence[float], own: Sequence[float], diagnosis: Diagnosis) -> list[Entry]:
    """Clipped at c, or the soft curve: τ - a (τ - c tanh(τ/c)) is l tanh(τ/l) to third order, l = c/√a."""
    if own[0] <= 0.0:
        return []
    clips = isinstance(term.effect, Clipping)
    level = shape[0] if clips else shape[0] / float(np.sqrt(own[0]))
    return [{"level": level, "shape": "clip" if clips else "compression"}]


def _delay(term: Term, shape: Sequence[float], own: Sequence[float], diagnosis: Diagnosis) -> list[Entry]:
    """A filter's delay a n T stands for it: to first order they are one."""
    return [{"delay": own[0] * shape[0] * getattr(term.effect, "order", 1) if shape else own[0]}]


def _displacement(term: Term, shape: Sequence[float], own: Sequence[float], diagnosis: Diagnosis) -> list[Entry]:
    link, axis = (int(each) for each in shape)
    return [{"link": link, "translation": [own[0] if number == axis else 0.0 for number in (1, 2, 3)]}]


ENTRIES: Mapping[str, Any] = {
    "asymmetric_coulomb": lambda t, s, c, d: [
        {"amplitude": 2.0 * c[0]},
        {"effect": "coulomb_friction", "level": -c[0]},
    ],
    "asymmetric_viscous": lambda t, s, c, d: [
        {"amplitude": 2.0 * c[0]},
        {"effect": "viscous_friction", "coefficient": -c[0]},
    ],
    "nonlinear_viscous": lambda t, s, c, d: [{"amplitude": c[0], "exponent": s[0]}],
    "load_dependent_friction": lambda t, s, c, d: [{"mu": c[0]}],
    "position_dependent_friction": lambda t, s, c, d: [
        {"amplitude": float(np.hypot(*c)), "order": s[0], "phase": float(np.arctan2(c[0], c[1]))}
    ],
    "stribeck_friction": lambda t, s, c, d: [{"amplitude": c[0], "velocity": s[0], "exponent": s[1]}],
    "presliding_hysteresis": lambda t, s, c, d: [{"distance": s[0]}],
    "friction_coupling": _coupling,
    "cogging": _wave,
    "torque_ripple": _wave,
    "joint_spring": lambda t, s, c, d: [{"stiffness": c[0]}],
    "cable_force": lambda t, s, c, d: [
        {
            "stiffness": c[0],
            "angle": s[0],
            "exponent": s[1],
            "side_of_angle": "above" if getattr(t.effect, "side", 1) > 0 else "below",
        }
    ],
    "rotor_inertia": lambda t, s, c, d: [{"inertia": c[0]}],
    "torque_gain_error": lambda t, s, c, d: [{"gain": 1.0 + c[0]}],
    "torque_saturation": _saturation,
    "time_delay": _delay,
    "base_tilt": _tilt,
    "kinematic_error": _displacement,
    "external_contact": _contact,
    "payload_change": _payload_change,
}
"""Entries by effect: from term, shape, coefficients and diagnosis."""
