"""The extended model for the simulated arm: a robot file with what was identified, a scenario with what was found.

Both in the forms that users write themselves, so that `tauscope run --backend sim` plays them. What a scenario cannot
say is a comment in it, never left out silently.
"""

import io
import os
from collections.abc import Sequence
from pathlib import Path

from ruamel.yaml import YAML

from tauscope.diagnosis.extended_model import consistent_links
from tauscope.diagnosis.findings.diagnosed import Diagnosis
from tauscope.diagnosis.model.torque_scale import on_the_arm
from tauscope.effects import Effect, Entry
from tauscope.effects.plain_terms import TorqueOffset
from tauscope.robot import Robot
from tauscope.robot.robot_data import link_to_dict
from tauscope.robot.robot_file import describe_bare_file
from tauscope.robot.xml_text import is_xml


def improved_robot(diagnosis: Diagnosis, source: Path, target: Path) -> str:
    """The robot file with the identified links, friction and shapes of friction in place of its own."""
    yaml = YAML(typ="rt")
    yaml.width = 4096
    content = source.read_bytes()
    data = describe_bare_file(content, source.name) if is_xml(content) else yaml.load(content.decode("utf-8"))
    for kind in ("urdf", "mjcf"):
        named = data["kinematics"].get(kind)
        if named is not None and not Path(named["file"]).is_absolute():
            named["file"] = os.path.relpath(source.parent / named["file"], target.parent)
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
    data["model"] = {"links": [link_to_dict(link) for link in links], "friction": friction}
    text = io.StringIO()
    yaml.dump(data, text)
    return text.getvalue()


def scenario_text(diagnosis: Diagnosis) -> str:
    """The findings as a scenario file, beside the robot file of `improved_robot`."""
    model, robot = diagnosis.selection.fit.model, diagnosis.robot
    joints = [joint.name for joint in robot.joints]
    values = dict(zip(model.structure.names, map(float, model.parameters), strict=True))
    entries: list[Entry] = []
    for joint, name in enumerate(joints):
        entries += _entries(TorqueOffset(joint), [values[f"offset {name}"]], [], robot)
    remarks = []
    for term in model.terms:
        coefficients = on_the_arm(model, term).coefficients
        found = _entries(term.effect, coefficients.tolist(), term.shape.tolist(), robot)
        entries += found
        if not found:
            reason = term.effect.no_scenario or "no scenario says this"
            remarks.append(f"# {term.effect.name(joints)}: {reason}; see the saved model\n")
    text = io.StringIO()
    YAML(typ="safe").dump({"effects": entries}, text)
    return f"# What {robot.name}'s recordings show beyond rigid bodies and plain friction.\n" + "".join(
        [*remarks, text.getvalue()]
    )


def _entries(effect: Effect, coefficients: Sequence[float], shape: Sequence[float], robot: Robot) -> list[Entry]:
    place = {} if effect.joint is None else {"joint": effect.joint + 1}
    made = effect.scenario_entries(coefficients, shape, robot)
    return [{"effect": effect.id, **place, **entry} for entry in made]
