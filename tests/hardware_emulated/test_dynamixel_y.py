"""What is peculiar to servos of the Y series: counts behind an electronic gear, errors that are cleared by a packet."""

from pathlib import Path

import numpy as np
import pytest

from hardware_emulated.servo_bench import WATCHDOG_S, bench, drive, limits, setpoint
from tauscope_drivers import ControlMode, DriverError, StopPolicy
from tauscope_drivers.dynamixel.control_table import find_model, gear_ratio_of, model_names
from tauscope_drivers.errors import DriverErrorKind
from tauscope_sim.dynamixel_bus import ServoSpecification
from tauscope_sim.emulation import FaultKind, InjectedFault

YM070_R099 = 4030
NUMERATOR = "Electronic GearRatio Numerator"

# ROBOTIS e-Manual, "Resolution" [counts a turn of the horn, of the motor's encoder], by model number.
RESOLUTION = {4000: 524_288, 4010: 524_288, 4020: 26_738_688, 4030: 51_904_512, 4040: 26_738_688, 4050: 51_904_512}


def servos(**registers: int) -> tuple[ServoSpecification, ...]:
    return tuple(
        ServoSpecification(number, YM070_R099, torque_per_milliampere=0.001, registers=registers if number == 2 else {})
        for number in (1, 2)
    )


@pytest.mark.parametrize("number", RESOLUTION)
def test_counts_of_the_horn_are_those_of_the_motor_behind_the_gear(number: int) -> None:
    model = find_model(number)
    assert gear_ratio_of(model_names()[number]) * 2.0 * np.pi * model.counts_per_radian == pytest.approx(
        RESOLUTION[number]
    )


@pytest.mark.realtime
def test_a_servo_with_another_electronic_gear_is_refused(tmp_path: Path) -> None:
    with bench(tmp_path, servos(**{NUMERATOR: 1})) as one:
        with pytest.raises(
            DriverError, match=r"joint2 .*Electronic GearRatio is 1:1, its counts are right at 99:1"
        ) as e:
            one.arm(torque_constant=0.001).connect()
        assert e.value.kind is DriverErrorKind.CANNOT_CONNECT
        assert not any(one.emulator.state["enabled"])


@pytest.mark.realtime
def test_an_error_whose_cause_is_gone_is_cleared_when_it_is_acknowledged(tmp_path: Path) -> None:
    with bench(tmp_path, servos()) as one:
        arm = one.arm(torque_constant=0.001)
        arm.connect()
        arm.enable(ControlMode.POSITION, limits(2), StopPolicy.HOLD, WATCHDOG_S)
        one.emulator.inject(InjectedFault(FaultKind.OVERLOAD, 2))
        (fault,) = drive(arm, lambda _: setpoint(np.full(2, 0.2)), 0.1)[-1].faults
        assert (fault.code, fault.joint) == ("overload", 2)
        arm.stop(StopPolicy.HOLD)
        assert not arm.acknowledge_faults().faults
        assert one.emulator.get(2, "Error Code") == 0
        assert not one.emulator.state["enabled"][1], "it was not switched on by that"


@pytest.mark.realtime
def test_an_error_whose_cause_persists_stays(tmp_path: Path) -> None:
    with bench(tmp_path, servos()) as one:
        arm = one.arm(torque_constant=0.001)
        arm.connect()
        one.emulator.inject(InjectedFault(FaultKind.OVER_TEMPERATURE, 1))
        with pytest.raises(DriverError, match="over-temperature") as refused:
            arm.acknowledge_faults()
        assert refused.value.kind is DriverErrorKind.FAULT
        assert one.emulator.get(1, "Error Code") == 4
