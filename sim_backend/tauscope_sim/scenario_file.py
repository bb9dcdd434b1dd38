"""The scenario file, read: YAML to a Scenario that fits a robot.

    torque_noise_std: [0.5, 0.3, 0.7]   # a number, or one a joint [Nm or N]
    position_noise_std: 2.0e-5          # likewise [rad or m]
    encoder_step: 1.0e-5                # likewise [rad or m]
    command_latency: 0.002              # [s]
    seed: 1
    effects:
      - {effect: cogging, joint: 2, amplitude: 0.4, order: 44, phase: 0.3}
      - {effect: time_delay, delay: 0.001}

Every key may be left out. What the keys of an effect mean stands in its file below `sim_backend/effects`; a joint is
its number, counted from 1, or its name.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import Field, ValidationError

from tauscope.errors import RobotFileError, ScenarioError
from tauscope.robot.bounded_file import decode_utf8, read_bounded
from tauscope.robot.document import DocumentOrigin, first_fault
from tauscope.robot.document_fields import Document
from tauscope.robot.messages import nearest, shown
from tauscope.robot.robot import Array, Robot
from tauscope.robot.yaml_text import Place, read_yaml
from tauscope_sim.effects import EFFECTS, Effect, ScenarioEntry, SensorEffect
from tauscope_sim.effects.effect import NotNegative, NotNegativeNumbers, Seed
from tauscope_sim.scenario import Scenario

LARGEST_SCENARIO_FILE = 256 * 1024
MOST_EFFECTS = 200


class ScenarioDocument(Document):
    """The scenario file's keys."""

    torque_noise_std: NotNegativeNumbers = Field(default=[0.0])
    position_noise_std: NotNegativeNumbers = Field(default=[0.0])
    encoder_step: NotNegativeNumbers = Field(default=[0.0])
    command_latency: NotNegative = 0.0  # [s]
    seed: Seed = 0
    effects: list[Any] = Field(default_factory=list, max_length=MOST_EFFECTS)


def read_scenario(path: Path | str | None, robot: Robot) -> Scenario:
    """The scenario of a file; None conceals nothing. Raises ScenarioError: one line, names file, entry and key."""
    if path is None:
        return Scenario()
    try:
        data = read_bounded(Path(path), LARGEST_SCENARIO_FILE)
    except RobotFileError as error:
        raise ScenarioError(str(error)) from error
    return scenario_from_yaml(data, str(path), robot)


def scenario_from_yaml(data: bytes, label: str, robot: Robot) -> Scenario:
    """The scenario of a YAML document. Raises ScenarioError if the document is not valid or does not fit the robot."""
    try:
        content = read_yaml(decode_utf8(data, label), label)
    except RobotFileError as error:
        raise ScenarioError(str(error).replace("this is no robot file", "this is no scenario file")) from error
    return _Reader(DocumentOrigin(label, content.data, content.lines), robot).scenario()


class _Reader:
    def __init__(self, origin: DocumentOrigin, robot: Robot) -> None:
        self._origin, self._robot = origin, robot

    def scenario(self) -> Scenario:
        document = self._validate(ScenarioDocument, self._origin.data, ())
        entries = [self._entry(value, number) for number, value in enumerate(document.effects)]
        scenario = Scenario(
            effects=tuple(entry for entry in entries if isinstance(entry, Effect)),
            sensor_effects=tuple(entry for entry in entries if isinstance(entry, SensorEffect)),
            torque_noise_std=self._per_joint(document, "torque_noise_std"),
            position_noise_std=self._per_joint(document, "position_noise_std"),
            encoder_step=self._per_joint(document, "encoder_step"),
            command_latency_s=document.command_latency,
            seed=document.seed,
        )
        try:
            scenario.plant(self._robot)
        except ScenarioError as error:
            raise self._error(("effects",), str(error)) from error
        return scenario

    def _entry(self, value: Any, number: int) -> ScenarioEntry:
        place: Place = ("effects", number)
        if not isinstance(value, Mapping):
            raise self._error(place, f"must be a mapping with the key effect, but is {shown(value)}")
        if "effect" not in value:
            raise self._error(place, f"the key 'effect' is missing; add it ({nearest('', EFFECTS)})")
        name = value["effect"]
        if not isinstance(name, str) or name not in EFFECTS:
            hint = nearest(name, EFFECTS) if isinstance(name, str) else "write an effect id"
            raise self._error((*place, "effect"), f"unknown effect {shown(name)}; {hint}")
        keys = {key: self._joint_number(key, part) for key, part in value.items() if key != "effect"}
        entry = self._validate(EFFECTS[name], keys, place, name)
        try:
            entry.check(self._robot)
        except ScenarioError as error:
            raise self._error(place, str(error)) from error
        return entry

    def _joint_number(self, key: str, value: Any) -> Any:
        if key not in ("joint", "other_joint", "link") or not isinstance(value, str):
            return value
        names = [joint.name for joint in self._robot.joints]
        return names.index(value) + 1 if value in names else value

    def _per_joint(self, document: ScenarioDocument, key: str) -> Array:
        values, count = getattr(document, key), self._robot.joint_count
        if len(values) not in (1, count):
            raise self._error((key,), f"holds {len(values)} numbers; give one, or one for each of {count} joints")
        return np.broadcast_to(np.array(values), (count,)).copy()

    def _validate(self, kind: type, data: Any, place: Place, effect: str = "") -> Any:
        if not isinstance(data, Mapping):
            raise self._error(place, f"must be a mapping, but is {shown(data)}")
        try:
            return kind.model_validate(data)
        except ValidationError as error:
            inner, text = first_fault(error)
        raise self._error((*place, *inner), text, effect)

    def _error(self, place: Place, text: str, effect: str = "") -> ScenarioError:
        where = self._origin.where(place)
        if effect:  # it stands behind its number
            before, entry, key = where.rpartition(f"effects[{place[1]}]")
            where = f"{before}{entry} ({effect}){key}"
        return ScenarioError(f"{where}: {text}")
