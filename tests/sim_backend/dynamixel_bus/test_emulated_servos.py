"""Emulated servos in virtual time: protocol, access rules, watchdog, errors, and every fault of the kit."""

import numpy as np
import pytest

from tauscope_drivers.dynamixel import packets
from tauscope_drivers.dynamixel.packets import DynamixelParser, Status, decode_fast, decode_status
from tauscope_sim.dynamixel_bus import DynamixelEmulator, ServoSpecification
from tauscope_sim.dynamixel_bus.arm import Pendulums
from tauscope_sim.dynamixel_bus.bus import EmulatedBus
from tauscope_sim.dynamixel_bus.servo import EmulatedServo
from tauscope_sim.emulation import FaultKind, InjectedFault

RETURN_DELAY, DRIVE_MODE, MODE, MAX_LIMIT = 9, 10, 11, 48
TORQUE, HARDWARE_ERROR, WATCHDOG, GOAL_CURRENT, PROFILE_VELOCITY, GOAL_POSITION = 64, 70, 98, 102, 112, 116
PRESENT, TEMPERATURE = 126, 146
STATUS_LEVEL = 68


class Master:
    """A master without a port: sends, lets time pass, keeps what came."""

    def __init__(self, count: int = 3, *, start: float = 0.2, weight: float = 0.0, **specification: object) -> None:
        specifications = [ServoSpecification(number, **specification) for number in range(1, count + 1)]  # pyright: ignore[reportArgumentType]
        arm = Pendulums([start] * count, weight=weight)
        servos = [EmulatedServo(one) for one in specifications]
        self.emulator = DynamixelEmulator(EmulatedBus(servos), arm, 0.0)
        self.time = 0.0

    def wait(self, seconds: float) -> bytes:
        arrived, end = b"", self.time + seconds
        while self.time < end:
            self.time = min(end, self.time + 1e-4)
            self.emulator.advance_to(self.time)
            arrived += self.emulator.due(self.time)
        return arrived

    def ask(self, request: bytes, seconds: float = 0.004) -> list[Status]:
        self.emulator.receive(request, self.time)
        statuses = [decode_status(frame) for frame in DynamixelParser().feed(self.wait(seconds))]
        return [status for status in statuses if status is not None]

    def read(self, servo: int, address: int, size: int = 1) -> int:
        (status,) = self.ask(packets.encode_read(servo, address, size))
        return int.from_bytes(status.data, "little", signed=size > 1)

    def write(self, servo: int, address: int, value: int, size: int = 1) -> int:
        (status,) = self.ask(packets.encode_write(servo, address, value.to_bytes(size, "little", signed=size > 1)))
        return status.error

    def prepare(self, mode: int = 5, watchdog: int = 0) -> None:
        """Return delay none, goals where the servos stand, torque on."""
        for servo in self.emulator.bus.servos:
            assert self.write(servo, RETURN_DELAY, 0) == 0
            assert self.write(servo, MODE, mode) == 0
            assert self.write(servo, GOAL_POSITION, self.read(servo, 132, 4), 4) == 0
            assert self.write(servo, GOAL_CURRENT, 400 if mode == 5 else 0, 2) == 0
            assert self.write(servo, WATCHDOG, watchdog) == 0
            assert self.write(servo, TORQUE, 1) == 0

    @property
    def position(self) -> np.ndarray:
        return self.emulator.arm.motion[0]


def test_ping_tells_model_and_firmware() -> None:
    assert Master().ask(packets.encode_ping(2)) == [Status(2, 0, (1020).to_bytes(2, "little") + bytes([52]))]
    assert [status.servo for status in Master().ask(packets.encode_ping(), 0.02)] == [1, 2, 3]


def test_answers_come_after_wire_and_return_delay() -> None:
    master = Master(1)
    request = packets.encode_read(1, PRESENT, 10)
    master.emulator.receive(request, 0.0)
    # 14 bytes out, 500 µs, 21 bytes back at 10 µs each.
    expected = (14 + 21) * 1e-5 + 500e-6
    assert master.emulator.next_due_s == pytest.approx(expected, abs=1e-9)


def test_sync_read_answers_in_the_order_of_the_list() -> None:
    answers = Master().ask(packets.encode_sync_read([3, 1, 2], PRESENT, 10), 0.01)
    assert [status.servo for status in answers] == [3, 1, 2]
    assert all(len(status.data) == 10 for status in answers)


def test_fast_sync_read_is_one_packet_that_the_driver_understands() -> None:
    master = Master()
    master.emulator.receive(packets.encode_sync_read([1, 2, 3], PRESENT, 10, fast=True), 0.0)
    frame = master.wait(0.01)
    assert len(frame) == 8 + 3 * 14
    assert [status.servo for status in decode_fast(frame, [1, 2, 3], 10)] == [1, 2, 3]


def test_bulk_read_and_bulk_write() -> None:
    master = Master()
    request = packets.encode_instruction(0xFE, 0x92, bytes([1, 144, 0, 2, 0, 2, 146, 0, 1, 0]))
    first, second = master.ask(request, 0.01)
    assert (first.servo, int.from_bytes(first.data, "little")) == (1, 120)
    assert (second.servo, second.data) == (2, bytes([30]))
    master.ask(
        packets.encode_instruction(0xFE, 0x93, bytes([1, 116, 0, 4, 0, 1, 2, 0, 0, 2, 112, 0, 4, 0, 9, 0, 0, 0]))
    )
    assert master.read(1, GOAL_POSITION, 4) == 0x201
    assert master.read(2, PROFILE_VELOCITY, 4) == 9


def test_reg_write_waits_for_action() -> None:
    master = Master(1)
    data = (116).to_bytes(2, "little") + (1234).to_bytes(4, "little")
    assert master.ask(packets.encode_instruction(1, 0x04, data))[0].error == 0
    assert master.read(1, GOAL_POSITION, 4) == 2048
    assert master.read(1, 69) == 1
    assert master.ask(packets.encode_instruction(1, 0x05))[0].error == 0
    assert master.read(1, GOAL_POSITION, 4) == 1234
    assert master.ask(packets.encode_instruction(1, 0x05))[0].error == 2


def test_sync_write_has_no_answer_and_is_carried_out() -> None:
    master = Master()
    goals = {servo: (2000 + servo).to_bytes(4, "little") for servo in (1, 2, 3)}
    assert master.ask(packets.encode_sync_write(goals, GOAL_POSITION)) == []
    assert [master.read(servo, GOAL_POSITION, 4) for servo in (1, 2, 3)] == [2001, 2002, 2003]


@pytest.mark.parametrize(
    ("address", "value", "size", "error"),
    [
        (132, 0, 4, 7),  # Present Position is read-only
        (130, 0, 1, 7),  # the middle of an item
        (116, 0, 2, 5),  # half of Goal Position
        (MODE, 2, 1, 4),  # no such mode
        (GOAL_POSITION, 5000, 4, 6),  # beyond Max Position Limit in mode 3
        (GOAL_CURRENT, 1194, 2, 6),  # beyond Current Limit
        (WATCHDOG, 128, 1, 4),
        (TORQUE, 2, 1, 4),
    ],
)
def test_writes_are_refused_as_the_manual_says(address: int, value: int, size: int, error: int) -> None:
    assert Master(1).write(1, address, value, size) == error


def test_eeprom_is_locked_under_torque() -> None:
    master = Master(1)
    master.write(1, TORQUE, 1)
    assert master.write(1, MODE, 0) == 7
    master.write(1, TORQUE, 0)
    assert master.write(1, MODE, 0) == 0


def test_unknown_instruction_is_refused() -> None:
    assert Master(1).ask(packets.encode_instruction(1, 0x77))[0].error == 2


def test_status_return_level_silences_writes_then_reads() -> None:
    master = Master(1)
    assert master.write(1, STATUS_LEVEL, 1) == 0
    assert master.ask(packets.encode_write(1, PROFILE_VELOCITY, bytes(4))) == []
    assert master.read(1, STATUS_LEVEL) == 1
    master.ask(packets.encode_write(1, STATUS_LEVEL, bytes([0])))
    assert master.ask(packets.encode_read(1, STATUS_LEVEL, 1)) == []
    assert len(master.ask(packets.encode_ping(1))) == 1


def test_goals_are_stale_after_power_up_and_torque_goes_for_them() -> None:
    master = Master(1, start=0.5)
    master.write(1, TORQUE, 1)
    master.wait(0.5)
    assert master.position[0] == pytest.approx(0.0, abs=0.01)


def test_drive_mode_bit_3_gives_torque_when_a_goal_is_written() -> None:
    master = Master(1)
    master.write(1, DRIVE_MODE, 8)
    assert master.read(1, TORQUE) == 0
    master.write(1, GOAL_POSITION, 2100, 4)
    assert master.read(1, TORQUE) == 1


def test_goal_current_caps_the_position_loop() -> None:
    master = Master(1, start=0.0, weight=2.0)
    master.prepare()
    master.write(1, GOAL_CURRENT, 20, 2)
    master.write(1, GOAL_POSITION, 3000, 4)
    master.wait(1.0)
    # 20 units of 2.69 mA at 0.01 Nm/mA hold 0.538 Nm: the pendulum of 2 Nm comes to rest, or swings, below asin 0.269.
    assert abs(master.emulator.torque[0]) <= 20 * 2.69 * 0.01 + 1e-9
    assert abs(master.position[0]) < 0.6
    assert abs(master.read(1, PRESENT, 2)) <= 22


def test_profile_velocity_limits_the_speed() -> None:
    master = Master(1, start=0.0)
    master.prepare()
    master.write(1, PROFILE_VELOCITY, 20, 4)  # 0.48 rad/s
    master.write(1, GOAL_POSITION, 2048 + 1304, 4)  # 2 rad
    master.wait(1.0)
    assert master.position[0] == pytest.approx(0.48, abs=0.05)


def test_current_mode_pushes_with_goal_current() -> None:
    master = Master(1, start=0.0)
    master.prepare(mode=0)
    master.write(1, GOAL_CURRENT, 10, 2)
    assert master.emulator.torque[0] == pytest.approx(0.269)
    master.wait(0.006)  # what is shown is the mean of five periods, one period ago
    assert master.read(1, PRESENT, 2) == pytest.approx(10, abs=2)


def latched(mode: int) -> Master:
    master = Master(1, start=0.3)
    master.prepare(mode, watchdog=3)
    master.write(1, GOAL_POSITION, 2500, 4) if mode == 5 else master.write(1, GOAL_CURRENT, 5, 2)
    master.wait(0.2)
    return master


def test_watchdog_fires_in_its_time_and_not_before() -> None:
    master = Master(1)
    master.prepare(watchdog=3)
    memory = master.emulator.servos[0].memory
    heard = master.time - 0.004
    master.wait(heard + 0.058 - master.time)
    assert not memory.is_latched
    master.wait(heard + 0.066 - master.time)
    assert memory.is_latched


def test_watchdog_is_fed_by_any_instruction_on_the_bus() -> None:
    master = Master(2)
    master.prepare(watchdog=3)
    for _ in range(20):
        master.wait(0.03)
        master.read(2, PRESENT, 2)
    assert not any(servo.memory.is_latched for servo in master.emulator.servos)


def test_watchdog_sleeps_without_torque() -> None:
    master = Master(1)
    master.write(1, WATCHDOG, 1)
    master.wait(0.2)
    assert not master.emulator.servos[0].memory.is_latched


def test_latched_servo_stops_refuses_goals_and_stays_so() -> None:
    master = latched(5)
    assert master.read(1, WATCHDOG) == 255
    assert master.write(1, GOAL_POSITION, 2048, 4) == 4
    assert master.write(1, GOAL_CURRENT, 0, 2) == 4
    place = master.position[0]
    master.wait(0.5)
    assert master.position[0] == pytest.approx(place, abs=0.01)


def test_clearing_the_watchdog_lets_the_servo_follow_its_old_goal() -> None:
    master = latched(5)
    assert master.write(1, WATCHDOG, 0) == 0
    master.wait(0.5)
    assert master.position[0] == pytest.approx((2500 - 2048) / 4096 * 2 * np.pi, abs=0.01)


def test_latched_servo_in_current_mode_exerts_nothing() -> None:
    master = latched(0)
    assert master.emulator.torque[0] == 0.0
    master.write(1, WATCHDOG, 0)
    assert master.emulator.torque[0] != 0.0


def test_overload_sets_the_alert_bit_and_lets_go_until_a_restart() -> None:
    master = Master(1)
    master.prepare()
    master.emulator.schedule.put(0.0, InjectedFault(FaultKind.OVERLOAD, 1))
    master.wait(0.002)
    (status,) = master.ask(packets.encode_read(1, HARDWARE_ERROR, 1))
    assert status.alert
    assert status.data == b"\x20"
    assert master.read(1, TORQUE) == 0
    assert master.write(1, TORQUE, 1) & 0x7F == 1
    master.ask(packets.encode_instruction(1, 0x08), 0.5)
    assert master.read(1, HARDWARE_ERROR) == 0
    assert master.write(1, TORQUE, 1) == 0


def test_over_temperature_is_shown_and_shuts_down() -> None:
    master = Master(1)
    master.prepare()
    master.emulator.schedule.put(0.0, InjectedFault(FaultKind.OVER_TEMPERATURE, 1))
    master.wait(0.002)
    assert master.read(1, HARDWARE_ERROR) == 4
    assert master.read(1, TEMPERATURE) > 80


def inject(master: Master, kind: FaultKind, **fault: float) -> None:
    injected = InjectedFault(kind, 2, **fault)  # pyright: ignore[reportArgumentType]
    master.emulator.schedule.put(injected.at_s, injected)
    master.wait(0.002)


SYNC = packets.encode_sync_read([1, 2, 3], PRESENT, 10)


def test_lost_answers() -> None:
    master = Master()
    inject(master, FaultKind.LOSE, count=2)
    answered = [[status.servo for status in master.ask(SYNC, 0.01)] for _ in range(3)]
    assert answered == [[1, 3], [1, 3], [1, 2, 3]]


def test_corrupt_answer() -> None:
    master = Master()
    inject(master, FaultKind.CORRUPT)
    assert [status.servo for status in master.ask(SYNC, 0.01)] == [1, 3]
    assert [status.servo for status in master.ask(SYNC, 0.01)] == [1, 2, 3]


def test_late_answer() -> None:
    master = Master()
    inject(master, FaultKind.LATE, seconds=0.02)
    assert [status.servo for status in master.ask(SYNC, 0.01)] == [1, 3]
    assert [status.servo for status in master.ask(b"", 0.02)] == [2]


def test_duplicated_answer() -> None:
    master = Master()
    inject(master, FaultKind.DUPLICATE)
    assert [status.servo for status in master.ask(SYNC, 0.01)] == [1, 2, 2, 3]


def test_silent_servo_neither_answers_nor_hears() -> None:
    master = Master()
    master.prepare(watchdog=3)
    inject(master, FaultKind.SILENT, seconds=0.2)
    for _ in range(15):
        assert [status.servo for status in master.ask(SYNC, 0.01)] == [1, 3]
    assert [servo.memory.is_latched for servo in master.emulator.servos] == [False, True, False]
    master.wait(0.1)
    assert [status.servo for status in master.ask(SYNC, 0.01)] == [1, 2, 3]


def test_silent_servo_cuts_the_fast_packet_short() -> None:
    master = Master()
    inject(master, FaultKind.SILENT)
    master.emulator.receive(packets.encode_sync_read([1, 2, 3], PRESENT, 10, fast=True), master.time)
    assert [status.servo for status in decode_fast(master.wait(0.01), [1, 2, 3], 10)] == [1]


def test_encoder_jump_shows_in_the_position() -> None:
    master = Master()
    before = master.read(2, 132, 4)
    inject(master, FaultKind.ENCODER_JUMP, counts=500)
    assert master.read(2, 132, 4) == before + 500


def test_reset_servo_forgets_torque_and_watchdog() -> None:
    master = Master()
    master.prepare(watchdog=100)
    inject(master, FaultKind.RESET, seconds=0.1)
    assert [status.servo for status in master.ask(SYNC, 0.01)] == [1, 3]
    master.wait(0.2)
    assert master.read(2, TORQUE) == 0
    assert master.read(2, WATCHDOG) == 0
    assert master.read(2, MODE) == 5  # EEPROM stays


def test_power_dip_takes_everybody() -> None:
    master = Master()
    master.prepare()
    inject(master, FaultKind.POWER_DIP, seconds=0.1)
    assert master.ask(SYNC, 0.01) == []
    master.wait(0.2)
    assert [master.read(servo, TORQUE) for servo in (1, 2, 3)] == [0, 0, 0]


def test_fault_waits_for_its_instant() -> None:
    master = Master()
    inject(master, FaultKind.LOSE, at_s=0.1)
    assert len(master.ask(SYNC, 0.01)) == 3
    master.wait(0.1)
    assert len(master.ask(SYNC, 0.01)) == 2


def test_noise_on_the_line_does_no_harm() -> None:
    master = Master()
    assert master.ask(b"\xff\xff\xfd\x00\x01\xff\xff" + bytes(range(256))) == []
    assert len(master.ask(b"\xff\xff\xfd" + SYNC, 0.01)) == 3


@pytest.mark.parametrize("model", [1120, 1200, 2020, 4030])
def test_other_families_answer_where_their_tables_say(model: int) -> None:
    master = Master(1, model_number=model)
    (status,) = master.ask(packets.encode_ping(1))
    assert int.from_bytes(status.data[:2], "little") == model


@pytest.mark.parametrize("part", [0.0, 0.25, 1.0])
def test_position_velocity_and_current_are_of_one_instant(part: float) -> None:
    servo = EmulatedServo(ServoSpecification(1, 2020, torque_per_milliampere=0.001, current_noise_ma=0.0))
    # all three rise by the same share in every period: whatever is shown, it is of one instant
    for period in range(40):
        servo.take_motion(0.01 * period, 0.5 * period, 0.1 * (period + 0.5))
    servo.sense(0.04, part)
    shown = [
        servo.memory.get("Present Position") / servo.specification.counts_per_radian / 0.01,
        servo.memory.get("Present Velocity") * servo.specification.figures.velocity_unit / 0.5,
        servo.memory.get("Present Current") * servo.specification.torque_per_unit / 0.1 - 1.0,
    ]
    # the middle of the last five periods, whose last ends now, or that much earlier
    np.testing.assert_allclose(shown, 39.0 - 2.5 - (1.0 - part), atol=0.02)


CLEAR_ERROR = bytes.fromhex("FF FF FD 00 01 08 00 10 02 45 52 43 4C D5 EB")
ERROR_CODE = 153


def test_a_y_servo_forgets_what_can_be_cleared_and_nothing_else() -> None:
    master = Master(1, model_number=4030)
    servo = master.emulator.bus.servos[1]
    for code, error, left in ((5, 0, 0), (18, 0, 0), (13, 1, 13)):
        servo.memory.put("Error Code", code)
        (status,) = master.ask(CLEAR_ERROR)
        assert (status.error & 0x7F, master.read(1, ERROR_CODE)) == (error, left)


def test_an_x_servo_knows_no_clear() -> None:
    (status,) = Master(1).ask(CLEAR_ERROR)
    assert status.error == 1
