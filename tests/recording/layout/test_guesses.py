"""Which of several families of columns a guess takes: the arm's own measurement, of one source, in its tool's unit."""

from itertools import permutations

import pytest

from tauscope.recording import Reading
from tauscope.recording.layout.guess import guess_layout
from tauscope.recording.mapping import suggest_layout

JOINTS = ("pan", "lift")
READING = Reading(joint_names=JOINTS)


def number(*templates: str) -> list[str]:
    return [template.format(k, k + 1, name=name) for template in templates for k, name in enumerate(JOINTS)]


CHOICES = {
    "measured beside an action": (
        ("observation.state.{name}.pos", "observation.effort.{name}", "action.{name}.pos"),
        {
            "q": "observation.state.{name}.pos",
            "tau": "observation.effort.{name}",
            "qref": "action.{name}.pos",
        },
    ),
    "of the arm whose effort is there": (
        ("leader_pos_{0}", "follower_pos_{0}", "follower_effort_{0}"),
        {"q": "follower_pos_{0}", "tau": "follower_effort_{0}"},
    ),
    "of the topic whose effort is there": (
        ("/sim/{name}/position", "/robot_of_cell_3/{name}/position", "/robot_of_cell_3/{name}/effort"),
        {"q": "/robot_of_cell_3/{name}/position", "tau": "/robot_of_cell_3/{name}/effort"},
    ),
    "of joints and not of the tool": (
        ("position_{1}", "joint_angle_{1}", "torque_{1}"),
        {"q": "joint_angle_{1}", "tau": "torque_{1}"},
    ),
    "a current of the q axis is no position": (
        ("{1}.position", "{1}.torque", "{1}.q_A"),
        {"q": "{1}.position", "tau": "{1}.torque"},
    ),
    "Iq is a current": (
        ("axis{0}.pos_estimate", "axis{0}.Iq_measured"),
        {"q": "axis{0}.pos_estimate", "i": "axis{0}.Iq_measured"},
    ),
    "FRI": (("mp{1}", "ip{1}", "mt{1}", "et{1}"), {"q": "mp{1}", "qref": "ip{1}", "tau": "mt{1}"}),
    "joints without a word": (("joint_{1}", "torque_{1}"), {"q": "joint_{1}", "tau": "torque_{1}"}),
    "targets of joints": (
        ("joint_target_{1}", "pos_{1}", "torque_{1}"),
        {"qref": "joint_target_{1}", "q": "pos_{1}", "tau": "torque_{1}"},
    ),
}


@pytest.mark.parametrize("name", CHOICES)
def test_the_arms_own_measurement_is_taken_in_any_order(name: str) -> None:
    templates, expected = CHOICES[name]
    for order in permutations(templates):
        layout = guess_layout(["tout", *number(*order)], READING)
        assert layout == {"t": "tout", **expected}


@pytest.mark.parametrize("index", ["", "Unnamed: 0", "__index_level_0__"])
def test_an_index_without_a_name_is_the_time(index: str) -> None:
    layout = guess_layout([*number("q{1}", "tau{1}"), index], READING)
    assert layout == {"t": 5, "q": "q{1}", "tau": "tau{1}"}
    named = guess_layout([index, "time", *number("q{1}", "tau{1}")], READING)
    assert named == {"t": "time", "q": "q{1}", "tau": "tau{1}"}


def test_seconds_and_nanoseconds_of_fri() -> None:
    layout = guess_layout(["time_stamp_sec", "time_stamp_nano_sec", *number("q{1}", "tau{1}")], READING)
    assert layout == {"t": ["time_stamp_sec", "time_stamp_nano_sec"], "q": "q{1}", "tau": "tau{1}"}


def test_repeated_names_as_pandas_numbers_them() -> None:
    layout = guess_layout(["time", "pos", "pos.1", "torque", "torque.1"], READING)
    assert layout == {"t": "time", "q": ["pos", "pos.1"], "tau": ["torque", "torque.1"]}
    counted = guess_layout(["time", "pos", "pos.1", "pos.2", "torque.1", "torque.2"], READING)
    assert counted == {"t": "time", "q": "pos.{1}", "tau": "torque.{1}"}


UNITS = {
    "odrive": (("axis{0}.pos_estimate", "axis{0}.vel_estimate", "axis{0}.Iq_measured"), {"q": "rev"}),
    "moteus": (("{1}.position", "{1}.velocity", "{1}.torque", "{1}.q_A"), {"q": "rev"}),
    "lerobot": (("observation.state.{name}.pos", "observation.effort.{name}"), {"q": "deg"}),
    "no tool's": (("position_{1}", "torque_{1}", "q_Actual_{1}"), {}),
}


@pytest.mark.parametrize("name", UNITS)
def test_a_guess_states_the_unit_of_the_tool_that_its_columns_show(name: str) -> None:
    templates, units = UNITS[name]
    layout = suggest_layout(["time", *number(*templates)], Reading(joint_names=JOINTS), "file.csv")
    assert layout is not None
    assert layout.units == units
