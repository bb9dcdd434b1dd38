"""A serial CAN adapter that is pulled out while it is open."""

from pathlib import Path

from drivers.canopen.serial_adapter import SerialAdapterBus
from sim_backend.emulation.pseudo_terminal import PseudoTerminal


def test_an_adapter_that_is_gone_can_be_let_go_of(tmp_path: Path) -> None:
    terminal = PseudoTerminal(str(tmp_path / "port"))
    bus = SerialAdapterBus(str(tmp_path / "port"), 1_000_000)
    terminal.close()
    bus.shutdown()
    assert not bus.serialPortOrig.is_open
    bus.shutdown()
