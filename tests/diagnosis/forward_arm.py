"""The paper's arm under the simulated drives, with encoders on its links and thermometers."""

from typing import Any

import numpy as np

from identification.simulated import PAPER_NOISE, Array, paper_robot
from tauscope.recording import Recording
from tauscope_drivers import ControlMode, DriveLimits, Setpoint, StopPolicy
from tauscope_sim.driver import SimulatedArm
from tauscope_sim.effects import EFFECTS, Effect
from tauscope_sim.motion import random_fourier_motion
from tauscope_sim.scenario import Scenario

RATE_HZ, PERIOD_S, PERIODS = 100.0, 8.0, 2
ENCODER_STEP = 2.0 * np.pi / 2**16


def forward_recording(seed: int, entry: dict[str, Any], rng: np.random.Generator, torque_noise: float) -> Recording:
    """A recording under one effect, as a scenario file writes it, with columns qlink and temp.

    Parameters
    ----------
    torque_noise : float
        relative to the paper's
    """
    robot = paper_robot()
    series = random_fourier_motion(robot.joints, np.random.default_rng(seed), period_s=PERIOD_S, limit_fraction=0.9)
    period = series.evaluate(np.arange(round(PERIOD_S * RATE_HZ)) / RATE_HZ).position
    setpoints = np.concatenate([np.tile(period[:1], (50, 1)), *[period] * PERIODS])
    motor, link, torque, temperature = (np.array(each) for each in zip(*_play(setpoints, entry), strict=True))
    motor, link = (ENCODER_STEP * np.rint(each / ENCODER_STEP) for each in (motor, link))
    return Recording.from_arrays(
        f"motion-{seed}",
        np.arange(len(setpoints)) / RATE_HZ,
        motor,
        torque + torque_noise * PAPER_NOISE * rng.standard_normal(torque.shape),
        temperature=np.rint(temperature),
        link_position=link,
    )


def _play(setpoints: Array, entry: dict[str, Any]) -> list[tuple[Array, Array, Array, Array]]:
    """Position of motors and links, torque and temperature at every setpoint, (n,) each."""
    effect = EFFECTS[entry["effect"]].model_validate({key: value for key, value in entry.items() if key != "effect"})
    assert isinstance(effect, Effect)
    arm = SimulatedArm(paper_robot(), Scenario(effects=(effect,)), start_position=setpoints[0])
    arm.connect()
    boundless = np.full(setpoints.shape[1], np.inf)
    limits = DriveLimits(-boundless, boundless, boundless, np.full(setpoints.shape[1], 1e4))
    arm.enable(ControlMode.POSITION, limits, StopPolicy.HOLD, 1.0)
    rows, step_ns = [], round(1e9 / RATE_HZ)
    for number, setpoint in enumerate(setpoints):
        arm.exchange(Setpoint(setpoint, np.zeros(len(setpoint))))
        mechanism = arm.device._mechanism
        true = mechanism.true
        *_, torque = mechanism._sample
        rows.append((true.motor_position, true.link_position, torque, true.temperature))
        arm.clock.wait_until_ns((number + 1) * step_ns)
    return rows
