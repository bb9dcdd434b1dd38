"""A model without missing physics but with wrong numbers: which links and joints have them."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from diagnosis.diagnosed_arm import recordings
from diagnosis.loaded_arm import carrying
from identification.simulated import Array, paper_robot, simulate
from tauscope.diagnosis import Diagnosis, DiagnosisDocument, against_model, against_simulation, diagnose, document
from tauscope.identification import Options
from tauscope.robot import FrictionCoefficients, LinkInertia, Robot

SEEDS = (1, 2, 3)


@cache
def sound() -> Diagnosis:
    """Of an arm that lacks nothing."""
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
