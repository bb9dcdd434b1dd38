"""The scenario file: what it says is what the simulation gets, and each refusal is one line that names the place."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from shared_data import REPOSITORY
from tauscope.errors import ScenarioError
from tauscope.robot import read_robot
from tauscope.robot.robot import Robot
from tauscope_sim.effects import EFFECTS, Effect, SensorEffect
from tauscope_sim.effects.periodic_torques import Cogging
from tauscope_sim.effects.sensor_effects import TimeDelay
from tauscope_sim.examples import example_robot
from tauscope_sim.plant import Plant
from tauscope_sim.scenario import Scenario
from tauscope_sim.scenario_file import read_scenario, scenario_from_yaml

ENTRIES: dict[str, str] = {
    "asymmetric_coulomb": "joint: 1, amplitude: 1",
    "asymmetric_viscous": "joint: 1, amplitude: 0.6",
    "backlash": "joint: 1, gap: 0.002, contact_stiffness: 20000, rotor_inertia: 0.1",
    "base_tilt": "about_x: 0.01",
    "cable_force": "joint: 2, stiffness: 4, angle: 0.5, side_of_angle: below",
    "cogging": "joint: 2, amplitude: [0.4, 0.1], order: [44, 88], phase: 0.3",
    "coulomb_friction": "joint: joint3, level: 0.5",
    "external_contact": "force: [8, 0, -3], start: 2, duration: 1.5, profile: rectangular",
    "friction_coupling": "joint: 2, other_joint: joint3, of: difference, coulomb: 1",
    "friction_drift": "joint: 1, thermal_resistance: 2, time_constant: 30, viscous_per_kelvin: -0.02",
    "joint_elasticity": "joint: 2, stiffness: 3000, damping: 1, rotor_inertia: 0.2",
    "joint_spring": "joint: 1, stiffness: 2, rest: 0.1",
    "kinematic_error": "link: 2, translation: [0.005, 0, 0]",
    "load_dependent_friction": "joint: 2, mu: 0.08",
    "nonlinear_viscous": "joint: 3, amplitude: 0.5, exponent: 2.2",
    "payload": "mass: 0.15, offset: [0, 0, 0.1]",
    "payload_change": "mass: 0.15, start: 43",
    "position_dependent_friction": "joint: 1, amplitude: 0.8",
    "presliding_hysteresis": "joint: 2, distance: 0.012, bristles: lugre, damping: 2",
    "rotor_inertia": "joint: 3, inertia: 0.3",
    "stribeck_friction": "joint: 2, amplitude: 1.5, velocity: 0.35",
    "time_delay": "delay: 0.004",
    "torque_gain_error": "joint: 2, gain: 1.05",
    "torque_offset": "joint: 1, torque: 0.5",
    "torque_ripple": "joint: 2, amplitude: 0.03, order: 8",
    "torque_saturation": "joint: 2, level: 30",
    "viscous_friction": "joint: 1, coefficient: 0.2",
}

LEVELS = """\
torque_noise_std: [0.5, 0.3, 0.7]
position_noise_std: 2.0e-5
encoder_step: 1.0e-5
command_latency: 0.002
seed: 4
"""


@pytest.fixture(scope="module")
def arm() -> Robot:
    return read_robot(example_robot("paper_arm"))


def scenario(text: str, robot: Robot) -> Scenario:
    return scenario_from_yaml(text.encode(), "s.yaml", robot)


def entry(text: str, robot: Robot) -> Scenario:
    return scenario(f"effects:\n  - {{{text}}}\n", robot)


def test_there_is_an_example_of_every_effect() -> None:
    assert set(ENTRIES) == set(EFFECTS)


def test_every_effect_of_the_contract_is_here() -> None:
    contract = REPOSITORY / ".." / "shared" / "CONTRACT.md"
    if not contract.exists():
        pytest.skip("the contract is not beside the repository")
    table = contract.read_text(encoding="utf-8").split("## Effect ids")[1]
    ids = {
        name for row in table.splitlines() for name in re.findall(r"`(\w+)`", row.split("|")[1] if "|" in row else "")
    }
    assert ids - {"unknown"} == set(EFFECTS)


@pytest.mark.parametrize("name", ENTRIES)
def test_every_effect_can_be_stated_and_simulated(name: str, arm: Robot) -> None:
    read = entry(f"effect: {name}, {ENTRIES[name]}", arm)
    assert len(read.effects) + len(read.sensor_effects) == 1
    kind = (*read.effects, *read.sensor_effects)[0]
    assert isinstance(kind, EFFECTS[name])
    plant = read.plant(arm)
    plant.place([0.1, -0.9, 0.7])
    plant.advance([0.5, 4.0, 1.0], 0.01)
    assert np.all(np.isfinite(plant.state.motor_position))
    read.sensors(arm).measure(0.0, plant.state.motor_position, np.ones(3))


def test_all_keys_are_read(arm: Robot, tmp_path: Path) -> None:
    path = tmp_path / "wrist.yaml"
    path.write_text(
        LEVELS + "effects:\n  - {effect: cogging, joint: joint2, amplitude: 0.4, order: 44, phase: 0.3}\n"
        "  - {effect: time_delay, delay: 0.001}\n",
        encoding="utf-8",
    )
    read = read_scenario(path, arm)
    assert read.effects == (Cogging(joint=2, amplitude=[0.4], order=[44.0], phase=[0.3]),)
    assert read.sensor_effects == (TimeDelay(delay=0.001),)
    np.testing.assert_array_equal(read.torque_noise_std, [0.5, 0.3, 0.7])
    np.testing.assert_array_equal(read.position_noise_std, [2e-5] * 3)
    np.testing.assert_array_equal(read.encoder_step, [1e-5] * 3)
    assert (read.command_latency_s, read.seed) == (0.002, 4)


def test_an_empty_mapping_conceals_nothing(arm: Robot) -> None:
    read = scenario("{}", arm)
    assert read.effects == read.sensor_effects == ()
    assert isinstance(Scenario().plant(arm), Plant)


REFUSED: dict[str, tuple[str, str]] = {
    "unknown effect": (
        "effect: coging, joint: 1",
        r"s.yaml:2: effects\[0\].effect: unknown effect 'coging'; did you mean 'cogging'\?",
    ),
    "no effect": ("joint: 1", r"s.yaml:2: effects\[0\]: the key 'effect' is missing"),
    "effect is no text": ("effect: 3", r"effects\[0\].effect: unknown effect 3; write an effect id"),
    "unknown key": (
        "effect: cogging, joint: 2, amplitude: 0.4, order: 44, phaze: 0.3",
        r"s.yaml:2: effects\[0\] \(cogging\).phaze: unknown key 'phaze'; did you mean 'phase'\?",
    ),
    "missing key": (
        "effect: torque_offset, joint: 2",
        r"s.yaml:2: effects\[0\] \(torque_offset\).torque: the key 'torque' is missing; add it",
    ),
    "joint beyond the arm": (
        "effect: torque_offset, joint: 4, torque: 1",
        r"s.yaml:2: effects\[0\]: torque_offset.joint: is 4, but the arm has 3 joints",
    ),
    "joint of another arm": (
        "effect: torque_offset, joint: wrist, torque: 1",
        r"effects\[0\] \(torque_offset\).joint: must be a number counted from 1 or a joint's name, but is 'wrist'",
    ),
    "joint zero": ("effect: torque_offset, joint: 0, torque: 1", r"\(torque_offset\).joint: must be a number counted"),
    "text for a number": (
        "effect: torque_offset, joint: 1, torque: 1 Nm",
        r"\(torque_offset\).torque: '1 Nm' is text; write a number without quotes and without a unit",
    ),
    "not finite": ("effect: torque_offset, joint: 1, torque: .nan", r"must be a finite number"),
    "wrong word": (
        "effect: cable_force, joint: 1, stiffness: 1, angle: 0, side_of_angle: left",
        r"\(cable_force\).side_of_angle: must be above or below, but is 'left'",
    ),
    "no gear ratio": (
        "effect: cogging, joint: 1, amplitude: 1, order: 2, angle: motor",
        r"cogging.angle: is motor, but the robot file states no gear_ratio for this joint; state it",
    ),
    "lists that do not match": (
        "effect: cogging, joint: 1, amplitude: [1, 2], order: [1, 2, 3]",
        r"cogging.amplitude: holds 2 numbers, order 3; give one each, or one for all",
    ),
    "locking friction": ("effect: load_dependent_friction, joint: 1, mu: 1.2", r"the transmission locks itself"),
    "ripple above the load": ("effect: torque_ripple, joint: 1, amplitude: [0.5, 0.5], order: [1, 2]", r"adds up to 1"),
    "a change of nothing": ("effect: payload_change, mass: 1", r"payload_change.start: is missing"),
    "an end before the start": ("effect: payload_change, mass: 1, start: 5, end: 4", r"not after start"),
    "force and torque": (
        "effect: external_contact, force: [1, 2, 3], joint: 1, torque: 2, start: 0, duration: 1",
        r"external_contact.force: stands beside joint or torque",
    ),
    "neither": ("effect: external_contact, start: 0, duration: 1", r"external_contact.force: is missing"),
    "vector of two": ("effect: payload, mass: 1, offset: [1, 2]", r"\(payload\).offset: must be three numbers"),
    "impossible body": ("effect: payload, mass: 1, moments: [1, 1, 3]", r"payload.moments: no body has these"),
    "damped Dahl bristles": (
        "effect: presliding_hysteresis, joint: 1, distance: 0.01, damping: 1",
        r"presliding_hysteresis.damping: belongs to the LuGre model",
    ),
    "coupled with itself": ("effect: friction_coupling, joint: 1, other_joint: 1", r"other_joint: is 1 too"),
    "exponent": ("effect: nonlinear_viscous, joint: 1, amplitude: 1, exponent: 99", r"above 0 and at most 10"),
    "untilted base": ("effect: base_tilt", r"base_tilt.about_x: and about_y are zero"),
    "link beyond the arm": ("effect: kinematic_error, link: 9, rotation: [0, 0, 1]", r"is 9, but the arm has 3 links"),
    "long delay": ("effect: time_delay, delay: 5", r"time_delay.delay: is 5 s; state at most 1 s"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_a_wrong_entry_is_named(name: str, arm: Robot) -> None:
    text, message = REFUSED[name]
    with pytest.raises(ScenarioError, match=message) as caught:
        entry(text, arm)
    assert "\n" not in str(caught.value)
    assert str(caught.value).startswith("s.yaml:2: effects")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", r"s.yaml: the file holds no entries"),
        ("- a", r"s.yaml:1: must be a mapping, but is a list of 1"),
        ("a: [", r"s.yaml:1: not valid YAML"),
        ("noise: 3", r"s.yaml:1: noise: unknown key 'noise'"),
        ("seed: -1", r"s.yaml:1: seed: must be a whole number of zero or more, but is -1"),
        ("seed: 1.5", r"s.yaml:1: seed: must be a whole number"),
        ("torque_noise_std: [1, 2]", r"s.yaml:1: torque_noise_std: holds 2 numbers; give one, or one for each of 3"),
        ("torque_noise_std: [1, -2, 3]", r"s.yaml:1: torque_noise_std\[1\]: must be zero or more, but is -2"),
        ("command_latency: -1", r"s.yaml:1: command_latency: must be zero or more"),
        ("effects: 3", r"s.yaml:1: effects: must be a list, but is 3"),
        ("effects: [3]", r"s.yaml:1: effects\[0\]: must be a mapping with the key effect, but is 3"),
    ],
)
def test_a_wrong_file_is_named(text: str, message: str, arm: Robot) -> None:
    with pytest.raises(ScenarioError, match=message):
        scenario(text, arm)


def test_effects_that_contradict_one_another(arm: Robot) -> None:
    elastic = f"  - {{effect: joint_elasticity, {ENTRIES['joint_elasticity']}}}\n"
    with pytest.raises(ScenarioError, match=r"s.yaml:1: effects: joint 2: .* states rotor_inertia itself"):
        scenario(f"effects:\n{elastic}  - {{effect: rotor_inertia, joint: 2, inertia: 0.1}}\n", arm)
    with pytest.raises(ScenarioError, match=r"joint 2: joint_elasticity or backlash stands twice"):
        scenario(f"effects:\n{elastic}{elastic}", arm)


def test_a_missing_file_is_named(arm: Robot, tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match=r"nowhere\.yaml: no such file; check the path"):
        read_scenario(tmp_path / "nowhere.yaml", arm)


def refusal_of(act: Callable[[], object]) -> str:
    """The message of a ScenarioError, or nothing; any other error fails the test."""
    try:
        act()
    except ScenarioError as error:
        return str(error)
    return ""


VALUES = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(-3, 4),
    st.floats(),
    st.sampled_from(["1e400", "-0.0", "1e9", "joint2", "motor", "lugre", "clip", "[0, 0]", "{}", "'", "{a: 1}", "*x"]),
)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_mutated_entries_are_read_or_refused_in_one_line(data: Any, arm: Robot) -> None:
    """Any value for any key: a scenario that can be simulated, or a ScenarioError; never a traceback."""
    name = data.draw(st.sampled_from(sorted(ENTRIES)))
    keys = dict(part.split(": ", 1) for part in re.split(r", (?=\w+: )", ENTRIES[name]))
    for key in data.draw(st.lists(st.sampled_from([*EFFECTS[name].model_fields, "effect", "extra"]), max_size=3)):
        value = data.draw(VALUES)
        keys[key] = (
            value if isinstance(value, str) else str(value).lower().replace("inf", ".inf").replace("nan", ".nan")
        )
    keys.setdefault("effect", name)
    text = ", ".join(f"{key}: {value}" for key, value in keys.items())

    def simulate() -> None:
        read = entry(text, arm)
        plant = read.plant(arm)
        plant.place([0.1, -0.9, 0.7])
        plant.advance([0.5, 4.0, 1.0], 2e-3)
        read.sensors(arm).measure(0.0, plant.state.motor_position, np.ones(3))

    assert "\n" not in refusal_of(simulate)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(cuts=st.lists(st.tuples(st.integers(0, 900), st.integers(0, 40), st.binary(max_size=6)), min_size=1, max_size=4))
def test_mutated_bytes_are_read_or_refused_in_one_line(cuts: list[tuple[int, int, bytes]], arm: Robot) -> None:
    lines = "".join(f"  - {{effect: {name}, {keys}}}\n" for name, keys in list(ENTRIES.items())[5:12])
    document = (LEVELS + "effects:\n" + lines).encode()
    for place, length, inserted in cuts:
        document = document[:place] + inserted + document[place + length :]
    assert "\n" not in refusal_of(lambda: scenario_from_yaml(document, "s.yaml", arm))


def test_effects_and_sensor_effects_are_told_apart() -> None:
    sensors = {name for name, kind in EFFECTS.items() if issubclass(kind, SensorEffect)}
    assert sensors == {"time_delay", "torque_gain_error", "torque_saturation"}
    assert all(issubclass(kind, Effect) for name, kind in EFFECTS.items() if name not in sensors)
