"""An arm's state from what its servos answered."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tauscope_drivers.dynamixel.bus import PATIENCE_S
from tauscope_drivers.dynamixel.group import GroupReading
from tauscope_drivers.dynamixel.session import Session
from tauscope_drivers.errors import Fault
from tauscope_drivers.state import ArmState

Array = NDArray[np.float64]


def observe(session: Session, temperature: Array | None = None, *failures: Fault) -> ArmState:
    """State without moving anything, with the errors of servos that set their alert bit.

    Parameters
    ----------
    temperature : (n,) float64 or None
        where it was just read [°C]
    """
    reading = session.group.read_patiently()
    for joint, alert in enumerate(reading.alerts):
        if alert and not session.health.states_error(joint):
            servo = session.servos[joint]
            item = servo.model.error_item
            answer = session.bus.read_once(servo.servo, item.address, item.size, PATIENCE_S)
            if answer is not None and len(answer.data) == item.size:
                session.health.take(joint, {item.name: item.decode(answer.data, item.address)})
    unknown = np.full(len(session.servos), np.nan)
    state = arm_state(session, reading, unknown if temperature is None else temperature)
    return replace(state, faults=state.faults + failures)


def arm_state(session: Session, reading: GroupReading, temperature: Array) -> ArmState:
    """State of a cycle.

    Parameters
    ----------
    temperature : (n,) float64
        where it was read in this cycle, else NaN [°C]
    """
    for joint, alert in enumerate(reading.alerts):
        if alert is not None:
            session.health.take_alert(joint, alert)
    return ArmState(
        time_ns=reading.time_ns,
        position=reading.position,
        velocity=reading.velocity,
        effort=reading.current,
        temperature=temperature,
        enabled=session.enabled,
        faults=session.health.faults,
        late_ns=reading.late_ns,
    )


def blind_state(time_ns: int, joint_count: int, faults: tuple[Fault, ...]) -> ArmState:
    """State of an arm that cannot be seen."""
    unknown = np.full(joint_count, np.nan)
    return ArmState(time_ns, unknown, unknown, unknown, unknown, np.zeros(joint_count, dtype=np.bool_), faults)
