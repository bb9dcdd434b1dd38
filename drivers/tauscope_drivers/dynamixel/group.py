"""The cyclic exchange with all servos: goals by Sync Write, state by (Fast) Sync Read, one servo's health in turn."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tauscope_drivers.dynamixel.bus import ServoBus
from tauscope_drivers.dynamixel.control_table import BYTES_BEFORE_STATE, STATE_ITEMS, Block, Item
from tauscope_drivers.dynamixel.packets import Status
from tauscope_drivers.dynamixel.servo import JointServo
from tauscope_drivers.serial_servos.bus import ATTEMPTS, PATIENCE_S, Answers
from tauscope_drivers.state import ArmState

PROBES = 3  # how often Fast Sync Read is tried before the firmware counts as not knowing it
PLAIN_CYCLES = 50  # for how many cycles each servo answers for itself, after a common packet broke off at a silent one

_CURRENT, _VELOCITY, _POSITION = STATE_ITEMS


@dataclass(frozen=True, eq=False)
class GroupReading:
    """What the servos measured in one cycle; NaN for who did not answer in it."""

    state: ArmState  # without temperature, health and faults; effort is current [mA]
    alerts: tuple[bool | None, ...]  # alert bit of each servo; None for who did not answer


class ServoGroup:
    """All servos of an arm; servos of different families are asked one family after the other."""

    def __init__(self, bus: ServoBus, servos: Sequence[JointServo]) -> None:
        self.servos = tuple(servos)
        self.fast = False
        self._bus = bus
        self.families = servo_families(servos)
        self._plain_cycles = 0
        self._turns = health_turns(servos)
        self._turn = 0
        self._alerted: set[int] = set()
        self._known_alerts: set[int] = set()

    def probe(self) -> list[Answers[Status]]:
        """Use Fast Sync Read from now on if all servos know it; answers, by which an adapter's latency is learnt."""
        probes = (self._read_all(fast=True, patience_s=PATIENCE_S).statuses for _ in range(PROBES))
        self.fast = any(statuses.keys() == self._ids for statuses in probes)
        return [self._read_all(fast=self.fast, patience_s=PATIENCE_S) for _ in range(PROBES)]

    def write(self, name: str, values: Sequence[int | None]) -> None:
        """Write an item of all servos, without an answer."""
        for items, chosen in item_writes(self.servos, name, values):
            self._bus.sync_write(items, chosen)

    def write_goals(self, goals: Sequence[int], speeds: Sequence[int]) -> None:
        """Write all Goal Positions, with Profile Velocity where it is a neighbour; one a joint [counts], [units]."""
        for items, values in paced_goals(self.servos, goals, speeds):
            self._bus.sync_write(items, values)

    def read(self, patience_s: float = 0.0) -> GroupReading:
        """State of all servos."""
        fast = self.fast and self._plain_cycles == 0
        self._plain_cycles = max(0, self._plain_cycles - 1)
        answers = self._read_all(fast=fast, patience_s=patience_s)
        if fast and answers.statuses.keys() != self._ids:
            self._plain_cycles = PLAIN_CYCLES
        reading = self._reading(answers)
        news = {index for index, alert in enumerate(reading.alerts) if alert} - self._known_alerts
        self._alerted |= news
        self._known_alerts = (self._known_alerts | news) - {
            i for i, alert in enumerate(reading.alerts) if alert is False
        }
        return reading

    def read_patiently(self) -> GroupReading:
        """State of all servos, asked for again while one is missing; for use outside the control loop."""
        for _ in range(ATTEMPTS):
            reading = self.read(PATIENCE_S)
            if None not in reading.alerts:
                break
        return reading

    def read_health(self) -> tuple[int, dict[str, int]]:
        """A piece of one servo's health: index of the joint, and values by name.

        Who has just set its alert bit is asked for its errors, else the next in turn. Nothing is asked twice; where no
        answer came, the values are empty.
        """
        if self._alerted:
            index = self._alerted.pop()
            block = self.servos[index].model.watched_blocks[1]
        else:
            index, block = self._turns[self._turn]
            self._turn = (self._turn + 1) % len(self._turns)
        answer = self._bus.read_once(self.servos[index].servo, block.address, block.length)
        return index, {} if answer is None else block.decode(answer.data)

    def read_watchdogs(self) -> dict[int, dict[str, int]]:
        """Health around the watchdog of all servos, asked for once: values by name for each index of a joint."""
        found: dict[int, dict[str, int]] = {}
        for _, members in self.families:
            blocks = self.servos[members[0]].model.health_blocks
            block = next(block for block in blocks if any(item.name == "Bus Watchdog" for item in block.items))
            answers = self._bus.sync_read([self.servos[index].servo for index in members], block)
            for index in members:
                if (status := answers.statuses.get(self.servos[index].servo)) is not None:
                    found[index] = block.decode(status.data)
        return found

    @property
    def _ids(self) -> set[int]:
        return {servo.servo for servo in self.servos}

    def _read_all(self, *, fast: bool, patience_s: float) -> Answers[Status]:
        """Answers of all families, as if to one question: asked when the first was, late as the latest."""
        found = [
            self._bus.sync_read(
                [self.servos[index].servo for index in members],
                block,
                fast=fast,
                patience_s=patience_s,
                spare=BYTES_BEFORE_STATE,
            )
            for block, members in self.families
        ]
        statuses = {servo: status for answers in found for servo, status in answers.statuses.items()}
        late_ns, beyond_ns = (max(getattr(one, name) for one in found) for name in ("late_ns", "beyond_ns"))
        return Answers(found[0].asked_ns, late_ns, statuses, beyond_ns)

    def _reading(self, answers: Answers[Status]) -> GroupReading:
        position, velocity, current = np.full((3, len(self.servos)), np.nan)
        alerts: list[bool | None] = [None] * len(self.servos)
        for index, servo in enumerate(self.servos):
            if (status := answers.statuses.get(servo.servo)) is None:
                continue
            values = servo.model.state_block.decode(status.data)
            position[index] = servo.units.position(values[_POSITION])
            velocity[index] = servo.units.velocity(values[_VELOCITY])
            current[index] = servo.units.current(values[_CURRENT])
            alerts[index] = status.alert
        none = ArmState.unknown(answers.asked_ns, len(self.servos))
        measured = replace(none, position=position, velocity=velocity, effort=current, late_ns=answers.late_ns)
        return GroupReading(measured, tuple(alerts))


def servo_families(servos: Sequence[JointServo]) -> list[tuple[Block, list[int]]]:
    """Servos whose control tables agree where they are read and written: the block of their state, their indices."""
    families: dict[tuple[int, int, int], tuple[Block, list[int]]] = {}
    for index, servo in enumerate(servos):
        block = servo.model.state_block
        key = (block.address, block.length, servo.model.items["Goal Position"].address)
        families.setdefault(key, (block, []))[1].append(index)
    return list(families.values())


def item_writes(
    servos: Sequence[JointServo], name: str, values: Sequence[int | None]
) -> Iterator[tuple[list[Item], dict[int, list[int]]]]:
    """Item and values of Sync Writes, one a family. `values`: one a joint, None where nothing is written."""
    for _, members in servo_families(servos):
        chosen = {servos[index].servo: [value] for index in members if (value := values[index]) is not None}
        if chosen:
            yield [servos[members[0]].model.items[name]], chosen


def paced_goals(
    servos: Sequence[JointServo], goals: Sequence[int], speeds: Sequence[int]
) -> Iterator[tuple[list[Item], dict[int, list[int]]]]:
    """Items and values of a cycle's Sync Writes, one a family. `goals`, `speeds`: one a joint [counts], [units]."""
    for _, members in servo_families(servos):
        model = servos[members[0]].model
        speed, goal = model.items["Profile Velocity"], model.items["Goal Position"]
        if speed.address + speed.size == goal.address:  # one write carries both
            yield [speed, goal], {servos[index].servo: [speeds[index], goals[index]] for index in members}
        else:
            yield [goal], {servos[index].servo: [goals[index]] for index in members}


def health_turns(servos: Sequence[JointServo]) -> list[tuple[int, Block]]:
    """Whose health is read in which cycle, and which piece of it: the watchdogs of all, then errors, then heat."""
    watched = [servo.model.watched_blocks for servo in servos]
    return [(index, blocks[piece]) for piece in range(3) for index, blocks in enumerate(watched)]
