"""A model without missing physics but with wrong numbers: which links and joints have them."""

import tempfile
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from diagnosis.diagnosed_arm import only_effects, recordings
from diagnosis.loaded_arm import carrying
from identification.simulated import Array, paper_robot, simulate
from robot.robot_texts import write_robot
from tauscope.diagnosis import Diagnosis, DiagnosisDocument, against_model, against_simulation, diagnose, document
from tauscope.identification import Options
from tauscope.robot import FrictionCoefficients, LinkInertia, Robot, read_robot

SEEDS = (1, 2, 3)


@cache
def sound() -> Diagnosis:
    """Of an arm that lacks nothing."""
    with only_effects(["payload"]):
        return diagnose(paper_robot(), recordings(SEEDS, None, np.random.default_rng(8)))


def compared(robot: Robot) -> DiagnosisDocument:
    """The same with another robot file."""
    found = sound()
    return document(against_model(replace(found, identification=replace(found.identification, robot=robot))))


def with_link(number: int, change: Callable[[LinkInertia], LinkInertia]) -> Robot:
    """The paper's arm as a robot file states it with one link wrong."""
    robot = paper_robot()
    assert robot.model.links is not None
    links = list(robot.model.links)
    links[number - 1] = change(links[number - 1])
    return replace(robot, model=replace(robot.model, links=tuple(links)))


def with_viscous(joint: int, value: float) -> Robot:
    robot = paper_robot()
    assert robot.model.friction is not None
    friction = list(robot.model.friction)
    friction[joint] = replace(friction[joint], viscous=value)
    return replace(robot, model=replace(robot.model, friction=tuple(friction)))


def scaled(factor: float) -> Callable[[LinkInertia], LinkInertia]:
    return lambda link: LinkInertia.from_vector(factor * link.to_vector())


def shifted(by: Array) -> Callable[[LinkInertia], LinkInertia]:
    """The same body about another centre of mass, by the parallel-axis theorem written out."""

    def about(centre: Array, mass: float) -> Array:
        return mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))

    def change(link: LinkInertia) -> LinkInertia:
        centre = link.first_moment / link.mass
        central = link.inertia - about(centre, link.mass)
        return LinkInertia(link.mass, link.mass * (centre + by), central + about(centre + by, link.mass))

    return change


def causes(found: DiagnosisDocument) -> set[tuple[int | str | None, str]]:
    return {
        (cause.link or cause.joint, cause.quantity)
        for entry in found.parameter_differences
        for cause in entry.explained_by
    }


def test_a_right_model_is_consistent() -> None:
    found = compared(paper_robot())
    assert found.verdict == "consistent"
    assert found.wrong_values == []
    assert found.next_experiment is None


@pytest.mark.parametrize(
    ("robot", "place", "quantity", "value"),
    [
        (with_link(3, scaled(0.7)), 3, "mass", np.sqrt(2.0)),
        (with_link(3, scaled(1.3)), 3, "mass", np.sqrt(2.0)),
        (with_link(2, scaled(1.4)), 2, "mass", np.sqrt(2.0)),
        (with_link(3, lambda link: replace(link, mass=1.0)), 3, "mass", np.sqrt(2.0)),
        (with_link(3, shifted(np.array([0.06, 0.0, 0.0]))), 3, "centre_of_mass_x", -0.25),
        (with_viscous(1, 0.1), "joint2", "viscous", 0.277),
    ],
)
def test_one_wrong_number_is_named_and_explains_all(
    robot: Robot, place: int | str, quantity: str, value: float
) -> None:
    found = compared(robot)
    assert found.verdict == "wrong_values"
    assert found.findings == []
    assert found.next_experiment is None
    assert causes(found) == {(place, quantity)}
    assert all(entry.explained_by for entry in found.parameter_differences)
    (cause,) = found.parameter_differences[0].explained_by
    assert abs(cause.value - value) < 4.0 * cause.std
    assert cause.simulation is not None
    assert abs(cause.simulation - value) > 10.0 * cause.std
    (sentence,) = found.wrong_values
    assert "that explains" in sentence


def test_a_link_and_a_joint_are_two_sentences() -> None:
    robot = with_link(3, scaled(0.7))
    found = compared(replace(robot, model=replace(robot.model, friction=with_viscous(1, 0.1).model.friction)))
    assert found.verdict == "wrong_values"
    assert causes(found) == {(3, "mass"), ("joint2", "viscous")}
    assert [sentence.split(" is ")[0] for sentence in found.wrong_values] == [
        "Mass of link 3",
        "Viscous friction of joint2",
    ]


def simulator_with(robot: Robot, stated: Robot) -> DiagnosisDocument:
    """The arm against recordings of a simulator, whose links the robot file may state."""
    simulated = [simulate(robot, seed=seed, periods=2).recording(name=f"simulated-{seed}") for seed in (21, 22)]
    found = sound()
    found = replace(found, identification=replace(found.identification, robot=stated))
    return document(against_simulation(found, simulated, Options()))


def test_a_simulator_with_a_wrong_mass_has_that_of_the_robot_file() -> None:
    robot = with_link(3, scaled(0.7))
    found = simulator_with(robot, robot)
    assert found.verdict == "wrong_values"
    assert causes(found) == {(3, "mass")}
    assert found.wrong_values[0].startswith("Mass of link 3 is 1.41")


def test_a_simulator_of_unknown_links_is_told_the_difference() -> None:
    """Its base parameters are not those of the robot file."""
    found = simulator_with(with_link(2, scaled(1.4)), paper_robot())
    assert found.verdict == "wrong_values"
    assert {link for link, _ in causes(found)} == {2}
    assert found.wrong_values[0].startswith("Added ")


def test_missing_friction_stays_a_finding_beside_a_wrong_mass() -> None:
    robot = with_link(3, scaled(0.7))
    assert robot.model.friction is not None
    friction = (*robot.model.friction[:1], FrictionCoefficients(stiction=0.8), *robot.model.friction[2:])
    found = compared(replace(robot, model=replace(robot.model, friction=friction)))
    assert ("viscous_friction", "joint2") in {(each.effect, each.joint) for each in found.findings}
    assert found.verdict == "explained"
    assert (3, "mass") in causes(found)


def test_a_body_at_the_tool_is_a_payload_and_no_wrong_value() -> None:
    """The arm carries less than the file says: no payload; more: one."""
    place = np.array([0.05, 0.04, 0.03])
    light = compared(carrying(paper_robot(), 0.3, place))
    assert light.verdict == "wrong_values"
    assert {where for where, _ in causes(light)} == {3}


URDF = """\
<robot name="three-joint-arm">
  <link name="base"/>
  <link name="shoulder"><inertial>
    <origin xyz="0 0 0.05"/><mass value="4.0"/>
    <inertia ixx="0.02" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.03"/>
  </inertial></link>
  <link name="upper"><inertial>
    <origin xyz="0.2 0.02 0.01"/><mass value="3.0"/>
    <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.06" iyz="0" izz="0.06"/>
  </inertial></link>
  <link name="lower"><inertial>
    <origin xyz="0.15 0 0.03"/><mass value="1.9"/>
    <inertia ixx="0.006" ixy="0" ixz="0" iyy="0.03" iyz="0" izz="0.03"/>
  </inertial></link>
  <joint name="pan" type="revolute">
    <parent link="base"/><child link="shoulder"/><axis xyz="0 0 1"/>
    <limit lower="-2.5" upper="2.5" velocity="2" effort="60"/><dynamics damping="0.6" friction="1.5"/>
  </joint>
  <joint name="lift" type="revolute">
    <origin xyz="0 0 0.2"/><parent link="shoulder"/><child link="upper"/><axis xyz="0 1 0"/>
    <limit lower="-2.5" upper="2.5" velocity="2" effort="60"/><dynamics damping="0.5" friction="1.2"/>
  </joint>
  <joint name="elbow" type="revolute">
    <origin xyz="0.4 0 0"/><parent link="upper"/><child link="lower"/><axis xyz="0 1 0"/>
    <limit lower="-2.5" upper="2.5" velocity="2" effort="30"/><dynamics damping="0.3" friction="0.8"/>
  </joint>
</robot>
"""


@cache
def arm_of_urdf() -> Diagnosis:
    """An arm that lacks nothing but what the robot file's URDF gets wrong."""
    robot = robot_of(URDF)
    rng = np.random.default_rng(4)
    made = [simulate(robot, seed=seed, periods=2) for seed in SEEDS[:2]]
    noise = np.array([0.2, 0.2, 0.1])
    with only_effects(["payload"]):
        return diagnose(robot, [arm.recording(arm.white(noise, rng), arm.white(2e-5, rng)) for arm in made])


def robot_of(urdf: str) -> Robot:
    with tempfile.TemporaryDirectory() as folder:
        text = "name: arm\nkinematics:\n  urdf: {file: arm.urdf, base: base, tip: lower}\njoints:\n"
        limits = "limits: {acceleration: 5.0}, friction_shape: {k_v: 500}"
        text += "".join(f"  - {{name: {name}, {limits}}}\n" for name in ("pan", "lift", "elbow"))
        return read_robot(write_robot(Path(folder), text, urdf))


@pytest.mark.parametrize(
    ("right", "wrong", "place", "quantities"),
    [
        ('<mass value="1.9"/>', '<mass value="1.2"/>', 3, {"mass"}),
        ('<mass value="3.0"/>', '<mass value="3.6"/>', 2, {"mass"}),
        ("0.15 0 0.03", "0.10 0 0.03", 3, {"centre_of_mass_x"}),
        ('damping="0.5"', 'damping="0.1"', "lift", {"viscous"}),
    ],
)
def test_a_wrong_number_of_a_urdf_is_named(right: str, wrong: str, place: int | str, quantities: set[str]) -> None:
    found = arm_of_urdf()
    robot = robot_of(URDF.replace(right, wrong))
    told = document(against_model(replace(found, identification=replace(found.identification, robot=robot))))
    assert told.verdict == "wrong_values"
    assert causes(told) == {(place, quantity) for quantity in quantities}


def test_a_zero_damping_of_a_urdf_is_a_finding() -> None:
    found = arm_of_urdf()
    robot = robot_of(URDF.replace('damping="0.5"', 'damping="0"'))
    told = document(against_model(replace(found, identification=replace(found.identification, robot=robot))))
    assert told.verdict == "explained"
    assert {(each.effect, each.joint) for each in told.findings} == {("viscous_friction", "lift")}
