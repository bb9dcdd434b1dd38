"""The plant without effects: MuJoCo's own integrator, energy, and what the interface promises."""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo's extension modules come without type stubs)

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from arms import panda_like, random_arm, random_link, ur5_like
from tauscope.errors import RobotFileError, ScenarioError
from tauscope.robot.robot import FrictionCoefficients, FrictionShape, Model, Robot
from tauscope_sim.effects.carried_bodies import PayloadChange
from tauscope_sim.effects.elastic_transmissions import JointElasticity
from tauscope_sim.effects.periodic_torques import JointSpring
from tauscope_sim.model import build_model
from tauscope_sim.plant import AMBIENT, Plant


def loaded(robot: Robot, rng: np.random.Generator, viscous: float = 0.0) -> Robot:
    """The arm with random links, and viscous friction where it is asked for."""
    count = robot.joint_count
    friction = (FrictionCoefficients(viscous=viscous),) * count if viscous else None
    return replace(robot, model=Model(tuple(random_link(rng) for _ in range(count)), friction))


@pytest.mark.parametrize("kind", ["ur5", "panda", "random"])
def test_the_arm_moves_as_mujoco_lets_it(kind: str, rng: np.random.Generator) -> None:
    """Same model, MuJoCo's Runge-Kutta of order four at a tenth of the step."""
    bare = {"ur5": ur5_like, "panda": panda_like, "random": lambda: random_arm(rng, 4)}[kind]()
    robot = loaded(bare, rng, viscous=0.3)
    model = build_model(robot)
    model.opt.timestep = 5e-5
    model.dof_damping[:] = 0.3
    data = mujoco.MjData(model)
    plant = Plant(robot)
    start = rng.uniform(-1.0, 1.0, robot.joint_count)
    plant.place(start)
    data.qpos[:] = start
    for _ in range(20):
        torque = rng.normal(scale=3.0, size=robot.joint_count)
        plant.advance(torque, 0.02)
        data.qfrc_applied[:] = torque
        for _ in range(400):
            mujoco.mj_step(model, data)
    scale = np.max(np.abs(data.qvel))
    np.testing.assert_allclose(plant.state.link_position, data.qpos, rtol=0, atol=1e-5 * scale)
    np.testing.assert_allclose(plant.state.link_velocity, data.qvel, rtol=0, atol=1e-4 * scale)


def test_energy_is_kept_without_friction(rng: np.random.Generator) -> None:
    robot = loaded(ur5_like(), rng)
    model = build_model(robot)
    model.opt.enableflags |= int(mujoco.mjtEnableBit.mjENBL_ENERGY)
    data = mujoco.MjData(model)

    def energy(plant: Plant) -> float:
        data.qpos[:], data.qvel[:] = plant.state.link_position, plant.state.link_velocity
        mujoco.mj_forward(model, data)
        return float(np.sum(data.energy))

    plant = Plant(robot)
    plant.place(rng.uniform(-1.0, 1.0, 6))
    start = energy(plant)
    kinetic = 0.0
    for _ in range(10):
        plant.advance(np.zeros(6), 0.1)
        kinetic = max(kinetic, float(data.energy[1]))
        assert energy(plant) == pytest.approx(start, abs=1e-4 * max(kinetic, 1.0))
    assert kinetic > 1.0


def test_an_interval_may_be_cut_as_one_likes(paper: Robot) -> None:
    """Held torque: one long advance, or many short ones that end between steps."""
    torque = np.array([3.0, 8.0, 2.5])
    ends = []
    for parts in (1, 7, 400):
        plant = Plant(paper)
        plant.place([0.1, -0.9, 0.7])
        for _ in range(parts):
            plant.advance(torque, 0.2 / parts)
        assert plant.state.time == pytest.approx(0.2, abs=1e-12)
        ends.append(plant.state.link_position)
    np.testing.assert_allclose(ends[1], ends[0], rtol=0, atol=1e-5)
    np.testing.assert_allclose(ends[2], ends[0], rtol=0, atol=1e-5)


def test_placing_starts_afresh(paper: Robot) -> None:
    """Also what was picked up is gone, and what comes with time comes again."""
    effects = [PayloadChange(mass=1.0, start=0.05), JointElasticity(joint=2, stiffness=900.0, rotor_inertia=0.1)]
    plant = Plant(paper, effects)
    ends = []
    for _ in range(2):
        plant.place([0.1, -0.9, 0.7])
        assert plant.state.time == 0.0
        for _ in range(100):
            plant.advance([0.0, 5.0, 1.0], 1e-3)
        ends.append(plant.state)
    for name in ("motor_position", "link_position", "motor_velocity"):
        np.testing.assert_array_equal(getattr(ends[0], name), getattr(ends[1], name))


def test_the_state_is_a_copy(paper: Robot) -> None:
    plant = Plant(paper)
    plant.place([0.1, -0.9, 0.7])
    plant.state.motor_position[:] = 7.0
    plant.state.link_position[:] = 7.0
    np.testing.assert_array_equal(plant.state.motor_position, [0.1, -0.9, 0.7])
    np.testing.assert_array_equal(plant.state.temperature, [AMBIENT] * 3)


def test_stiction_holds_a_small_torque_nearly_still(paper: Robot) -> None:
    """K_v = 500 s/rad: half of the stiction makes it creep at tan(π/4)/K_v = 2 mrad/s, and no faster."""
    robot = replace(paper, gravity=np.zeros(3))
    plant = Plant(robot)
    plant.place([0.0, 0.3, 0.2])
    plant.advance([0.0, 0.0, 1.0], 0.5)
    # τ_s S₀(v) + τ_sc S_δ(v) + τ_v v = 1 at this speed
    assert plant.state.link_velocity[2] == pytest.approx(2.03e-3, rel=0.02)


def test_a_light_link_with_steep_friction_is_integrated_stably(paper: Robot) -> None:
    """Time constant 3e-7 s, step 5e-4 s: it creeps at the speed at which friction balances the torque."""
    link = replace(paper.model.links[0], inertia=np.diag([1e-4] * 3))  # pyright: ignore[reportOptionalSubscript]
    joint = replace(paper.joints[0], friction_shape=FrictionShape(500.0, 10.0))
    robot = replace(
        paper,
        joints=(joint,),
        segments=paper.segments[:1],
        model=Model((link,), (FrictionCoefficients(1.0, 0.0, 0.1),)),
    )
    plant = Plant(robot)
    plant.place([0.0])
    for torque in (0.3, -0.6, 0.7):
        plant.advance([torque], 0.05)
        speed = plant.state.link_velocity[0]
        assert 2.0 / np.pi * np.arctan(500.0 * speed) + 0.1 * speed == pytest.approx(torque, rel=1e-6)


@pytest.mark.parametrize("position", [[0.0, 0.0], [0.0, np.nan, 0.0]])
def test_a_place_that_is_none_is_refused(position: list[float], paper: Robot) -> None:
    with pytest.raises(ScenarioError, match="one finite number for each of 3 joints"):
        Plant(paper).place(position)


@pytest.mark.parametrize("duration_s", [-1e-3, float("nan")])
def test_time_does_not_run_backwards(duration_s: float, paper: Robot) -> None:
    with pytest.raises(ScenarioError, match="time passes forwards only"):
        Plant(paper).advance(np.zeros(3), duration_s)


def test_a_robot_without_links_is_refused(paper: Robot) -> None:
    with pytest.raises(RobotFileError, match=r"model\.links states 0 of 3 links"):
        Plant(replace(paper, model=Model()))


@pytest.mark.parametrize("step_s", [0.0, -1e-3, float("nan")])
def test_a_step_that_is_none_is_refused(step_s: float, paper: Robot) -> None:
    with pytest.raises(ScenarioError, match="positive duration"):
        Plant(paper, step_s=step_s)


def test_motion_without_bounds_is_said_in_one_line(paper: Robot) -> None:
    plant = Plant(paper, [JointSpring(joint=3, stiffness=-1e9)])
    plant.place([0.0, 0.0, 1e-3])
    with pytest.raises(ScenarioError, match=r"grows beyond all bounds at .* s"):
        plant.advance([0.0, 0.0, 0.0], 5.0)
