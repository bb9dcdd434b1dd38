"""Interfaces of python-can beside serial adapters and the kernel's: what they need is given, what they lack is said."""

import json
import re
import socket
import sys
import threading
import time
from collections.abc import Iterator
from dataclasses import replace

import can
import numpy as np
import pytest

from emulated_can_bus import EmulatedBus
from patience import eventually
from tauscope_drivers import ControlMode, DriveLimits, DriverError, Setpoint, StopPolicy
from tauscope_drivers.canopen.arm import CanopenArm
from tauscope_drivers.canopen.bus import CanBus
from tauscope_drivers.canopen.configuration import BusConfiguration
from tauscope_drivers.canopen.doctor import examine
from tauscope_drivers.canopen.interfaces import open_interface
from tauscope_drivers.drive_block import DriveJoint
from tauscope_drivers.errors import DriverErrorKind
from tauscope_drivers.inspection import Severity

_SEND = re.compile(r"< send ([0-9A-F]{3}) ([0-8]) ((?:[0-9a-f]{1,2} )*) ?>")
CHANNEL = "can0"


class Daemon:
    """A socketcand before python-can's virtual bus: one client at a time, in raw mode."""

    def __init__(self, channel: str) -> None:
        self._bus = can.Bus(interface="virtual", channel=channel)
        self._server = socket.create_server(("127.0.0.1", 0))
        self._server.settimeout(0.05)
        self._ends = threading.Event()
        self._thread = threading.Thread(target=self._serve)
        self._thread.start()

    @property
    def port(self) -> int:
        return self._server.getsockname()[1]

    def close(self) -> None:
        self._ends.set()
        self._thread.join()
        self._server.close()
        self._bus.shutdown()

    def _serve(self) -> None:
        while not self._ends.is_set():
            try:
                client, _ = self._server.accept()
            except TimeoutError:
                continue
            with client:
                self._serve_one(client)

    def _serve_one(self, client: socket.socket) -> None:
        client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        client.sendall(b"< hi >")
        client.settimeout(0.0005)
        text, is_raw = "", False
        while not self._ends.is_set():
            try:
                received = client.recv(4096)
                if not received:
                    return
                text += received.decode("ascii")
            except TimeoutError:
                pass
            except ConnectionError:
                return
            *whole, text = re.split(r"(?<=>)", text)
            for line in whole:
                self._take(client, line)
                is_raw |= line == "< rawmode >"
            while (message := self._bus.recv(0.0)) is not None:
                if not is_raw:
                    continue
                data = bytes(message.data).hex().upper()
                client.sendall(f"< frame {message.arbitration_id:03X} {time.time():.6f} {data} >".encode("ascii"))

    def _take(self, client: socket.socket, line: str) -> None:
        if line in (f"< open {CHANNEL} >", "< rawmode >"):
            client.sendall(b"< ok >")
            return
        sent = _SEND.fullmatch(line)
        assert sent is not None, line
        data = bytes(int(one, 16) for one in sent[3].split())
        assert len(data) == int(sent[2])
        self._bus.send(can.Message(arbitration_id=int(sent[1], 16), data=data, is_extended_id=False))


@pytest.fixture
def bus() -> Iterator[EmulatedBus]:
    with EmulatedBus() as one:
        yield one


@pytest.fixture
def daemon(bus: EmulatedBus) -> Iterator[Daemon]:
    one = Daemon(bus.channel)
    yield one
    one.close()


def joints(bus: EmulatedBus, port: int) -> list[DriveJoint]:
    """Drives of a bus of another machine."""
    there = {"interface": "socketcand", "channel": CHANNEL, "options": {"host": "127.0.0.1", "port": port}}
    first, *others = bus.joints()
    return [replace(first, drive={**first.drive, **there}), *others]


def test_an_arm_on_another_machines_bus_is_moved(bus: EmulatedBus, daemon: Daemon) -> None:
    arm = CanopenArm(joints(bus, daemon.port), patience_s=0.1)
    state = arm.connect()
    limits = DriveLimits(*(np.full(3, value) for value in (-2.0, 2.0, 4.0, 20.0)))
    state = arm.enable(ControlMode.POSITION, limits, StopPolicy.HOLD, 2.0, 0.01)
    place = state.position
    for _ in range(30):
        place = place + 0.004
        arm.clock.wait_until_ns(state.time_ns + 10_000_000)
        state = arm.exchange(Setpoint(place, np.zeros(3)))
    assert state.fresh.all()
    assert eventually(lambda: np.allclose(bus.position, place, rtol=0.0, atol=1e-5))
    arm.stop(StopPolicy.HOLD)
    arm.disconnect()


def test_a_second_master_on_another_machines_bus_is_refused(bus: EmulatedBus, daemon: Daemon) -> None:
    first, second = (CanopenArm(joints(bus, daemon.port), patience_s=0.1) for _ in range(2))
    first.connect()
    with pytest.raises(DriverError, match=r"driven by process \d+ \(.+\) already"):
        second.connect()
    first.disconnect()
    second.connect()
    second.disconnect()


@pytest.mark.parametrize(
    ("interface", "options", "words"),
    [
        ("socketcand", {}, "it needs the host of the daemon"),
        ("vector", {}, "vector can0 cannot be opened"),
        ("no-such-interface", {}, "no-such-interface can0 cannot be opened"),
        ("slcan", {"host": "a"}, "slcan takes no options, and was given host"),
    ],
)
def test_what_an_interface_lacks_is_told_in_one_line(interface: str, options: dict[str, str], words: str) -> None:
    with pytest.raises(DriverError, match=re.escape(words)) as caught:
        CanBus(BusConfiguration((), interface, "can0", options=options))
    assert caught.value.kind is DriverErrorKind.CANNOT_CONNECT
    assert "\n" not in str(caught.value)
    assert "drive.options" in str(caught.value)


def test_an_option_that_nobody_knows_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    def picky(**_: object) -> None:
        raise TypeError("unexpected keyword argument 'colour'")

    monkeypatch.setattr(can, "Bus", picky)
    with pytest.raises(DriverError, match=r"unexpected keyword argument 'colour'.*drive\.options"):
        CanBus(BusConfiguration((), "pcan", "PCAN_USBBUS1", options={"colour": "red"}))


def test_a_daemon_that_is_not_there_is_a_finding_at_once(bus: EmulatedBus) -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
    (finding,) = examine(joints(bus, port))
    assert finding.severity is Severity.FAILURE
    assert "refused" in finding.detail
    assert finding.remedy


def test_what_an_interface_is_opened_with(monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[dict[str, object]] = []
    monkeypatch.setattr(can, "Bus", lambda **given: opened.append(given))
    open_interface("pcan", "PCAN_USBBUS1", 500_000, {"auto_reset": True})
    assert opened.pop() == {"interface": "pcan", "channel": "PCAN_USBBUS1", "bitrate": 500_000, "auto_reset": True}
    with socket.create_server(("127.0.0.1", 0)) as server:
        options = {"host": "127.0.0.1", "port": server.getsockname()[1]}
        open_interface("socketcand", CHANNEL, 1_000_000, options)
        assert opened.pop()["tcp_tune"] == (sys.platform == "linux"), "no frame waits for an acknowledgement"
        open_interface("socketcand", CHANNEL, 1_000_000, {**options, "tcp_tune": False})
        assert opened.pop()["tcp_tune"] is False, "whoever says otherwise is heard"
        monkeypatch.setenv("CAN_CONFIG", json.dumps(options))
        open_interface("socketcand", CHANNEL, 1_000_000, {})
        given = opened.pop()
        assert (given["host"], given["port"]) == (options["host"], options["port"]), "of python-can's configuration"
