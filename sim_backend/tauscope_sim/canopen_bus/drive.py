"""One emulated CiA 402 drive: objects, power state, modes, heartbeats. Time and frames go in, frames come out."""

from collections.abc import Container
from dataclasses import dataclass
from enum import Enum
from functools import partial

from tauscope_drivers.canopen.data_sheet.device_file import DeviceFile
from tauscope_sim.canopen_bus import object_dictionary
from tauscope_sim.canopen_bus.object_dictionary import ProcessData
from tauscope_sim.canopen_bus.power_state import PowerState, PowerStateMachine


class AxisMode(Enum):
    """What a drive does to its joint."""

    RELEASED = "released"
    HOLDING = "holding"
    POSITION = "position"
    TORQUE = "torque"


@dataclass(frozen=True)
class AxisDemand:
    """What a drive wants of its joint. `interpolation_s`: from one target to the next, where it is told; else 0 [s]."""

    mode: AxisMode
    position: float = 0.0  # target where the mode is position [rad or m]
    torque: float = 0.0  # target where the mode is torque [Nm or N]
    torque_cap: float = 0.0  # most that it exerts; nothing where it is released [Nm or N]
    interpolation_s: float = 0.0


@dataclass(frozen=True)
class AxisScale:
    """Counts and per mille of an emulated drive."""

    counts_per_radian: float
    rated_torque_mnm: int  # object 0x6076, at the motor shaft [mNm]
    gear_ratio: float

    @property
    def torque_per_permille(self) -> float:
        """Joint torque of one part in thousand of the rated torque [Nm or N]."""
        return self.rated_torque_mnm / 1e6 * self.gear_ratio


Frame = tuple[int, bytes]
REMOTE = 1 << 30  # flag of a remote frame's identifier, as the kernel has it

INTERPOLATED_POSITION = 7
CYCLIC_POSITION = 8
CYCLIC_TORQUE = 10

HEARTBEAT_LOST = 0x8130
_BUS_OFF_RECOVERED = 0x8140

_SYNC, _NMT = 0x080, 0x000
_PRE_OPERATIONAL, _OPERATIONAL, _STOPPED = 0x7F, 0x05, 0x04
_NMT_COMMANDS = {0x01: _OPERATIONAL, 0x02: _STOPPED, 0x80: _PRE_OPERATIONAL}
_NMT_RESETS = (0x81, 0x82)
_QUICK_STOP_STAYS = range(5, 9)
_STANDING = 1e-3
_INTERPOLATE = 0x10
_PERIODS, _EXPONENTS = range(1, 256), range(-6, 1)  # values of 0x60C2 that are taken


class EmulatedDrive:
    """A drive with its node on the bus."""

    def __init__(self, node_id: int, scale: AxisScale, file: DeviceFile | None = None) -> None:
        """Power up. `file`: whose objects it has; all that a master may need where None."""
        self.node_id = node_id
        self.scale = scale
        self._file = file
        self.power_up()

    def power_up(self) -> None:
        """Come up as after a power dip: everything that a master wrote is forgotten."""
        self.power = PowerStateMachine()
        self.dictionary = self._dictionary()
        self.process_data = ProcessData(self.dictionary, self.node_id)
        if self._file is not None:
            object_dictionary.apply_sheet(self.dictionary, self._file)
        self.power.quick_stop_stays = self.dictionary.get(0x605A) in _QUICK_STOP_STAYS
        self._nmt = _PRE_OPERATIONAL
        self._is_off_bus = False
        self._mode_taken = 0
        self._next_heartbeat_s = 0.0
        self._last_master_s: float | None = None
        self._last_guard_s: float | None = None
        self._toggle = 0
        self._outbox: list[Frame] = [(0x700 + self.node_id, b"\0")]

    def receive(self, frame: Frame, now_s: float) -> list[Frame]:
        """Answers to a frame of the bus. it came [s]."""
        identifier, payload = frame
        if identifier == _NMT and len(payload) == 2 and payload[1] in (0, self.node_id):
            self._follow_network(payload[0])
        elif identifier == 0x600 + self.node_id and self._nmt != _STOPPED:
            answer = object_dictionary.answer_request(self.dictionary, payload)
            return [] if answer is None else [(0x580 + self.node_id, answer)]
        elif identifier == 0x700 + self._watched_node:
            self._last_master_s = now_s
        elif identifier == REMOTE | 0x700 + self.node_id and not self.dictionary.get(0x1017):
            self._last_guard_s = now_s
            self._toggle ^= 0x80
            return [(0x700 + self.node_id, bytes([self._toggle ^ 0x80 | self._nmt]))]
        elif self._nmt == _OPERATIONAL and identifier == _SYNC:
            return self.process_data.synchronise()
        elif self._nmt == _OPERATIONAL:
            self.process_data.take(identifier, payload)
        return []

    def tick(self, now_s: float) -> list[Frame]:
        """What the drive sends by itself by an instant: boot-up, heartbeat, emergencies."""
        self._watch_master(now_s)
        frames, self._outbox = self._outbox, []
        period_s = self.dictionary.get(0x1017) / 1e3
        if period_s and now_s >= self._next_heartbeat_s:
            self._next_heartbeat_s = now_s + period_s
            frames.append((0x700 + self.node_id, bytes([self._nmt])))
        return frames

    def demand(self) -> AxisDemand:
        """What the drive wants of its joint now."""
        cap = self.dictionary.get(0x6072) * self.scale.torque_per_permille
        if self.power.state is PowerState.QUICK_STOP_ACTIVE:
            return AxisDemand(AxisMode.HOLDING, torque_cap=cap)
        if self.power.state is not PowerState.OPERATION_ENABLED:
            return AxisDemand(AxisMode.RELEASED)
        if self._mode_taken in (CYCLIC_POSITION, INTERPOLATED_POSITION):
            low, high = (self.dictionary.get(0x607D, end) for end in (1, 2))
            target = min(max(self._target_count, low), high)
            place = target / self.scale.counts_per_radian
            period_s = 0.0
            if self.dictionary.has(0x60C2, 1):
                period_s = self.dictionary.get(0x60C2, 1) * 10.0 ** self.dictionary.get(0x60C2, 2)
            return AxisDemand(AxisMode.POSITION, position=place, torque_cap=cap, interpolation_s=period_s)
        if self._mode_taken == CYCLIC_TORQUE:
            torque = self.dictionary.get(0x6071) * self.scale.torque_per_permille
            return AxisDemand(AxisMode.TORQUE, torque=min(max(torque, -cap), cap), torque_cap=cap)
        return AxisDemand(AxisMode.HOLDING, torque_cap=cap)

    def measure(self, position: float, velocity: float, torque: float) -> None:
        """Let the sensors see the joint. [rad or m], [rad/s or m/s], [Nm or N]."""
        put, scale = self.dictionary.put, self.scale
        put(0x6064, round(position * scale.counts_per_radian))
        put(0x606C, round(velocity * scale.counts_per_radian))
        put(0x6077, round(torque / scale.torque_per_permille))
        if abs(velocity) < _STANDING:
            self.power.end_quick_stop()
        self._show_status()

    def fail(self, error_code: int) -> None:
        """Go into fault and say so."""
        self.power.fail()
        self._report(error_code)

    def leave_bus(self) -> None:
        """Its controller has seen too many errors: the drive does what 0x6007 says, and nobody hears of it yet."""
        self._is_off_bus = True
        self._nmt = _PRE_OPERATIONAL
        self._abort_connection()

    def return_to_bus(self) -> None:
        """Its controller was restarted: the drive tells that it was away."""
        if self._is_off_bus:
            self._is_off_bus = False
            self._report(_BUS_OFF_RECOVERED)

    @property
    def _target_count(self) -> int:
        if self._mode_taken == CYCLIC_POSITION:
            return self.dictionary.get(0x607A)
        starts = self.dictionary.get(0x6040) & _INTERPOLATE
        return self.dictionary.get(0x60C1, 1) if starts else self.dictionary.get(0x6064)

    @property
    def _watched_node(self) -> int:
        word = self.dictionary.get(0x1016, 1)
        return (word >> 16 & 0x7F) if word & 0xFFFF and word >> 16 & 0x7F else -1

    def _watch_master(self, now_s: float) -> None:
        """React to a master that stays away, also one never heard; guarding begins with a remote frame."""
        heartbeat_s = (self.dictionary.get(0x1016, 1) & 0xFFFF) / 1e3 if self._watched_node >= 0 else 0.0
        life_s = self.dictionary.get(0x100C) * self.dictionary.get(0x100D) / 1e3
        if not heartbeat_s:
            self._last_master_s = None
        elif self._last_master_s is None:
            self._last_master_s = now_s
        if not life_s:
            self._last_guard_s = None
        watches = ((self._last_master_s, heartbeat_s), (self._last_guard_s, life_s))
        if all(heard_s is None or now_s - heard_s <= limit_s for heard_s, limit_s in watches):
            return
        self._last_master_s, self._last_guard_s = now_s, None
        if self.power.state is PowerState.OPERATION_ENABLED:
            self._abort_connection()
            self._report(HEARTBEAT_LOST)
        self._nmt = _PRE_OPERATIONAL

    def _abort_connection(self) -> None:
        """Do what 0x6007 says."""
        reactions = {1: self.power.fail, 2: self.power.disable, 3: self.power.quick_stop}
        reaction = reactions.get(self.dictionary.get(0x6007))
        if reaction and self.power.state is PowerState.OPERATION_ENABLED:
            reaction()

    def _report(self, error_code: int) -> None:
        self.dictionary.put(0x603F, error_code)
        register = 0x11 if error_code in (HEARTBEAT_LOST, _BUS_OFF_RECOVERED) else 0x01
        self.dictionary.put(0x1001, register)
        payload = error_code.to_bytes(2, "little") + bytes([register]) + bytes(5)
        self._outbox.append((0x080 + self.node_id, payload))
        self._show_status()

    def _follow_network(self, command: int) -> None:
        if command in _NMT_RESETS:
            self.power_up()
        else:
            self._nmt = _NMT_COMMANDS.get(command, self._nmt)
        if self._nmt != _OPERATIONAL:
            self.power.quick_stop()

    def _show_status(self) -> None:
        word = self.power.state.value
        if self.power.state not in (PowerState.QUICK_STOP_ACTIVE, PowerState.NOT_READY):
            word |= 0x20 if word & 0x07 else 0
        follows = self.power.state is PowerState.OPERATION_ENABLED and self._mode_taken in (7, 8, 10)
        self.dictionary.put(0x6041, word | 0x0200 | (0x1000 if follows else 0))

    def _take_controlword(self, word: int) -> None:
        was = self.power.state
        self.power.command(word)
        is_new = self.power.state is not was
        if is_new and (was is PowerState.FAULT or self.power.state is PowerState.OPERATION_ENABLED):
            self.dictionary.put(0x603F, 0)
            self.dictionary.put(0x1001, 0)
        self._show_status()

    def _take_mode(self, mode: int) -> None:
        known = (INTERPOLATED_POSITION, CYCLIC_POSITION, CYCLIC_TORQUE)
        if mode not in known or not self.dictionary.get(0x6502) >> (mode - 1) & 1:
            raise object_dictionary.AbortError(object_dictionary.Abort.VALUE_RANGE)
        self._mode_taken = mode
        self.dictionary.put(0x6061, mode)

    def _dictionary(self) -> object_dictionary.ObjectDictionary:
        """Entries at power-up; the target position is stale on purpose, as it is on a real drive after a run."""
        dictionary = object_dictionary.ObjectDictionary()
        for index, subindex, size, value, signed, writable in _ENTRIES:
            dictionary.entries[index, subindex] = object_dictionary.Entry(size, value, signed, writable)
        for (index, subindex), hook in self._hooks().items():
            dictionary.entries[index, subindex].hook = hook
        dictionary.put(0x6076, self.scale.rated_torque_mnm)
        dictionary.put(0x6041, PowerState.SWITCH_ON_DISABLED.value | 0x0200)
        return dictionary

    def _hooks(self) -> dict[tuple[int, int], object_dictionary.WriteHook]:
        def count_silence_anew(_: int) -> None:
            self._last_master_s = None

        def take_option(option: int) -> None:
            self.power.quick_stop_stays = option in _QUICK_STOP_STAYS

        return {
            (0x1016, 1): count_silence_anew,
            (0x6040, 0): self._take_controlword,
            (0x605A, 0): take_option,
            (0x6060, 0): self._take_mode,
            (0x60C2, 1): partial(_require, _PERIODS),
            (0x60C2, 2): partial(_require, _EXPONENTS),
        }


def _require(taken: Container[int], value: int) -> None:
    if value not in taken:
        raise object_dictionary.AbortError(object_dictionary.Abort.VALUE_RANGE)


_ENTRIES = (
    # index, subindex, bytes, value, signed, writable
    (0x1000, 0, 4, 0x00020192, False, False),
    (0x1001, 0, 1, 0, False, False),
    (0x100C, 0, 2, 0, False, True),
    (0x100D, 0, 1, 0, False, True),
    (0x1016, 1, 4, 0, False, True),
    (0x1017, 0, 2, 0, False, True),
    (0x1018, 1, 4, 0x00000000, False, False),
    (0x6007, 0, 2, 1, True, True),
    (0x603F, 0, 2, 0, False, False),
    (0x6040, 0, 2, 0, False, True),
    (0x6041, 0, 2, 0, False, False),
    (0x605A, 0, 2, 2, True, True),
    (0x605E, 0, 2, 0, True, True),
    (0x6060, 0, 1, 0, True, True),
    (0x6061, 0, 1, 0, True, False),
    (0x6064, 0, 4, 0, True, False),
    (0x606C, 0, 4, 0, True, False),
    (0x6071, 0, 2, 0, True, True),
    (0x6072, 0, 2, 3000, False, True),
    (0x6075, 0, 4, 1000, False, False),
    (0x6076, 0, 4, 0, False, False),
    (0x6077, 0, 2, 0, True, False),
    (0x607A, 0, 4, 0x00100000, True, True),
    (0x607D, 1, 4, -(2**31), True, True),
    (0x607D, 2, 4, 2**31 - 1, True, True),
    (0x60C2, 1, 1, 1, False, True),
    (0x60C2, 2, 1, -3, True, True),
    (0x6502, 0, 4, 1 << (CYCLIC_POSITION - 1) | 1 << (CYCLIC_TORQUE - 1), False, False),
)
