"""An arm's state from what its servos answered."""

from dataclasses import replace

import numpy as np

from tauscope_drivers.errors import Fault
from tauscope_drivers.feetech.bus import ATTEMPTS, PATIENCE_S, Answers
from tauscope_drivers.feetech.registers import FEEDBACK, VOLT
from tauscope_drivers.feetech.session import Session
from tauscope_drivers.state import ArmState


def observe(session: Session, *failures: Fault) -> ArmState:
    """State without moving anything, asked for again while a servo is missing."""
    for _ in range(ATTEMPTS):
        answers = session.bus.sync_read(session.identifiers, FEEDBACK, PATIENCE_S)
        if len(answers.statuses) == len(session.servos):
            break
    state = arm_state(session, answers)
    return replace(state, faults=state.faults + failures)


def arm_state(session: Session, answers: Answers) -> ArmState:
    """State of a cycle; NaN for who did not answer in it."""
    position, velocity, load, temperature, voltage = np.full((5, len(session.servos)), np.nan)
    for joint, servo in enumerate(session.servos):
        if (status := answers.statuses.get(servo.servo)) is None:
            continue
        values = FEEDBACK.decode(status.data)
        position[joint] = servo.position(values["Present Position"])
        velocity[joint] = servo.velocity(values["Present Speed"])
        load[joint] = servo.load(values["Present Load"])
        temperature[joint], voltage[joint] = values["Present Temperature"], values["Present Voltage"] * VOLT
        session.health.take_alarms(joint, status.alarms)
    return ArmState(
        time_ns=answers.asked_ns,
        position=position,
        velocity=velocity,
        effort=load,
        temperature=temperature,
        enabled=session.health.has_torque.copy(),
        faults=session.health.faults,
        late_ns=answers.late_ns,
        voltage=voltage,
    )


def blind_state(time_ns: int, joint_count: int, faults: tuple[Fault, ...]) -> ArmState:
    """State of an arm that cannot be seen."""
    unknown = np.full(joint_count, np.nan)
    return ArmState(time_ns, unknown, unknown, unknown, unknown, np.zeros(joint_count, dtype=np.bool_), faults)
