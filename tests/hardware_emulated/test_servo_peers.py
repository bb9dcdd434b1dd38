"""Other people's masters on the same emulated servos: rustypot and dynamixel-sdk's own packet handler."""

from pathlib import Path

import numpy as np
import pytest
from dynamixel_sdk import COMM_SUCCESS, GroupSyncRead, PacketHandler, PortHandler

from hardware_emulated.servo_bench import bench, feetech_bench
from tauscope_sim.dynamixel_bus import ServoSpecification

pytestmark = pytest.mark.realtime  # other people's masters wait by the machine's clock

START = 0.4
XL330 = tuple(ServoSpecification(number, model_number=1200) for number in (1, 2, 3))


def test_rustypot_reads_and_moves_the_servos(tmp_path: Path) -> None:
    rustypot = pytest.importorskip("rustypot")
    with bench(tmp_path, XL330, start=START, weight=0.0) as one:
        master = rustypot.Xl330PyController(one.emulator.order.port, 1_000_000, 1.0)
        assert master.scan([1, 2, 3, 4]) == {1: 1200, 2: 1200, 3: 1200}
        assert master.ping(2)
        assert not master.ping(9)
        np.testing.assert_allclose(master.sync_read_present_position([1, 2, 3]), START, atol=2e-3)
        assert [int(value) for value in master.read_firmware_version(1)] == [52]
        ids = [1, 2, 3]
        master.sync_write_goal_position(ids, [START, START, 0.7])
        master.sync_write_torque_enable(ids, [True, True, True])
        one.wait_until(lambda state: abs(state["position"][2] - 0.7) < 0.01 and abs(state["velocity"][2]) < 0.01)
        np.testing.assert_allclose(master.sync_read_present_position(ids), [START, START, 0.7], atol=0.01)


def test_the_librarys_own_packet_handler_reads_and_writes_the_servos(tmp_path: Path) -> None:
    with bench(tmp_path, start=START) as one:
        port = PortHandler(one.emulator.order.port)
        assert port.openPort()
        assert port.setBaudRate(1_000_000)
        handler = PacketHandler(2.0)
        assert handler.ping(port, 2) == (1020, COMM_SUCCESS, 0)
        assert handler.read4ByteTxRx(port, 1, 132)[0] == round(START * 4096 / (2.0 * np.pi)) + 2048
        assert handler.write4ByteTxRx(port, 1, 116, 1234) == (COMM_SUCCESS, 0)
        assert one.emulator.get(1, "Goal Position") == 1234
        for fast in (False, True):
            group = GroupSyncRead(port, handler, 126, 10)
            assert all(group.addParam(servo) for servo in (1, 2, 3))
            assert (group.fastSyncRead() if fast else group.txRxPacket()) == COMM_SUCCESS
            assert group.getData(3, 132, 4) == round(START * 4096 / (2.0 * np.pi)) + 2048
        port.closePort()


def test_rustypot_reads_and_moves_sts3215_servos(tmp_path: Path) -> None:
    rustypot = pytest.importorskip("rustypot")
    with feetech_bench(tmp_path, start=START, weight=0.0) as one:
        master = rustypot.Sts3215PyController(one.emulator.order.port, 1_000_000, 1.0)
        ids = [1, 2, 3]
        assert master.scan([1, 2, 3, 4]) == dict.fromkeys(ids, 777)
        assert master.ping(2)
        assert not master.ping(9)
        np.testing.assert_allclose(master.sync_read_present_position(ids), START, atol=2e-3)
        assert [int(value) for value in master.read_present_voltage(1)] == [74]
        assert int(master.read_raw_data(2, 33, 1)[0]) == 0
        master.sync_write_goal_position(ids, [START, START, 0.7])
        for _ in range(500):
            position = master.sync_read_present_position(ids)
            if abs(position[2] - 0.7) < 0.01:
                break
        np.testing.assert_allclose(position, [START, START, 0.7], atol=0.01)
