"""The memory of an emulated servo: bytes, and the registers that it knows itself."""

PLACES = {
    "model": (3, 2),
    "id": (5, 1),
    "baud": (6, 1),
    "return_delay": (7, 1),
    "status_level": (8, 1),
    "min_position": (9, 2),
    "max_position": (11, 2),
    "max_temperature": (13, 1),
    "max_voltage": (14, 1),
    "min_voltage": (15, 1),
    "max_torque": (16, 2),
    "phase": (18, 1),
    "unloading": (19, 1),
    "kp": (21, 1),
    "kd": (22, 1),
    "ki": (23, 1),
    "mode": (33, 1),
    "torque_enable": (40, 1),
    "acceleration": (41, 1),
    "goal_position": (42, 2),
    "goal_time": (44, 2),
    "goal_speed": (46, 2),
    "torque_limit": (48, 2),
    "lock": (55, 1),
    "position": (56, 2),
    "speed": (58, 2),
    "load": (60, 2),
    "voltage": (62, 1),
    "temperature": (63, 1),
    "status": (65, 1),
    "moving": (66, 1),
}
SIGN_BITS = {"goal_position": 15, "goal_speed": 15, "position": 15, "speed": 15, "load": 10}
RAM = 40
SIZE = 96
_READ_ONLY = (*range(5), *range(56, 71))

DELIVERED = {
    "model": 777,
    "return_delay": 250,
    "status_level": 1,
    "max_position": 4095,
    "max_temperature": 70,
    "max_voltage": 80,
    "min_voltage": 40,
    "max_torque": 1000,
    "phase": 12,
    "unloading": 44,
    "kp": 32,
    "kd": 32,
}


class Memory:
    """Numbers by name, bytes by address."""

    is_latched = False

    def __init__(self, servo: int, registers: dict[str, int]) -> None:
        self._bytes = bytearray(SIZE)
        self._bytes[0:2] = (3, 10)
        for name, value in {**DELIVERED, "id": servo, **registers}.items():
            self.put(name, value)
        self.eeprom_writes = 0
        self.restart()
        for name, value in registers.items():
            self.put(name, value)

    def get(self, name: str) -> int:
        address, size = PLACES[name]
        value = int.from_bytes(self._bytes[address : address + size], "little")
        if (bit := SIGN_BITS.get(name)) is None:
            return value
        return (value % (1 << bit)) * (-1 if value & 1 << bit else 1)

    def put(self, name: str, value: int) -> None:
        address, size = PLACES[name]
        if value < 0:
            value = -value | 1 << SIGN_BITS[name]
        self._bytes[address : address + size] = value.to_bytes(size, "little")

    def read(self, address: int, length: int) -> bytes:
        return bytes(self._bytes[address : address + length]).ljust(length, b"\0")

    def write(self, address: int, data: bytes) -> list[str]:
        """Names of what was written; what is read-only stays as it is."""
        self.eeprom_writes += address < RAM
        for place, byte in enumerate(data, address):
            if place < SIZE and place not in _READ_ONLY:
                self._bytes[place] = byte
        return [name for name, (start, _) in PLACES.items() if address <= start < address + len(data)]

    def restart(self) -> None:
        """RAM as after power-up; goals are as stale as can be."""
        self._bytes[RAM:] = bytes(SIZE - RAM)
        for name, value in {"lock": 1, "voltage": 74, "temperature": 30}.items():
            self.put(name, value)
        self.put("torque_limit", self.get("max_torque"))
