"""Robot descriptions as people bring them: every row robots/ of the cases' README."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

import tauscope
from diagnosis.diagnosed_arm import few_or_all, only_effects
from shared_data import SHARED_CASES, needs_shared_cases
from tauscope.robot import Robot, find_defect, read_robot
from tauscope.robot.robot import Coupling

pytestmark = needs_shared_cases

ROBOTS = SHARED_CASES / "robots"


def codes(robot: Robot) -> set[str]:
    return {warning.code for warning in robot.warnings}


@pytest.mark.parametrize("name", ["01-rounding-inertia/arm.yaml", "01-rounding-inertia/arm-m.yaml"])
def test_rounded_inertia_is_read_and_the_repair_is_said(name: str) -> None:
    robot = read_robot(ROBOTS / name)
    assert codes(robot) == {"repaired-inertial"}
    assert "→" in robot.warnings[0].text
    assert robot.model.links is not None
    assert find_defect(robot.model.links[0]) is None


def test_inertia_without_triangle_is_read_and_the_repair_is_said() -> None:
    robot = read_robot(ROBOTS / "02-inertia-without-triangle.urdf")
    assert codes(robot) == {"repaired-inertial", "default-chain"}
    assert any("0.02 + 0.02 < 0.09" in warning.text for warning in robot.warnings)


@pytest.mark.parametrize("name", ["arm.yaml", "arm.urdf"])
def test_prefix_that_is_not_declared_is_read(name: str) -> None:
    assert [joint.name for joint in read_robot(ROBOTS / "04-undeclared-prefix" / name).joints] == ["j1"]


def test_gripper_beside_the_chain_counts() -> None:
    robot = read_robot(ROBOTS / "63-gripper-beside" / "arm.yaml")
    assert codes(robot) == {"rigid-branch"}
    assert robot.model.links is not None
    assert robot.model.links[-1].mass == pytest.approx(0.1879 + 0.4 + 2 * 0.25)


@pytest.mark.parametrize(("name", "links"), [("pal.yaml", 3), ("pal2.yaml", 2)])
def test_palletiser_works_with_its_masters(name: str, links: int) -> None:
    robot = read_robot(ROBOTS / "64-mimic" / name)
    assert [joint.name for joint in robot.joints] == ["j1", "j2"]
    assert robot.link_count == links
    assert [each.coupling for each in robot.segments[2:]] == [Coupling(1, -1.0, 0.0)] * (links - 2)


@pytest.mark.parametrize("path", sorted(ROBOTS.rglob("*.urdf")), ids=lambda path: path.parent.name)
def test_every_urdf_is_a_robot_by_itself(path: Path) -> None:
    robot = read_robot(path)
    assert "default-chain" in codes(robot)
    assert robot.model.links is not None
    assert np.isfinite([link.to_vector() for link in robot.model.links]).all()


@pytest.mark.parametrize(
    "name",
    [
        "01-rounding-inertia/arm.yaml",
        *(
            pytest.param(name, marks=pytest.mark.slow)
            for name in ("02-inertia-without-triangle.urdf", "64-mimic/pal.yaml", "64-mimic/pal.urdf")
        ),
    ],
)
def test_motion_is_designed(name: str) -> None:
    design = tauscope.design_excitation(ROBOTS / name, period_s=5.0, harmonics=2, periods=1, slow_reversals=False)
    assert design.design.trajectory.joints


@pytest.mark.slow
@pytest.mark.parametrize("effects", few_or_all("joint_spring", "payload"))
def test_exact_model_with_a_gripper_is_consistent(effects: Sequence[str] | None) -> None:
    folder = ROBOTS / "63-gripper-beside"
    with only_effects(effects):
        found = tauscope.diagnose(folder / "arm.yaml", folder / "run.csv", folder / "held.csv", against="model")
    assert (found.document.verdict, found.document.findings) == ("consistent", [])
