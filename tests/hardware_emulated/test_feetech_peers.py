"""Another people's master on the same emulated servos: rustypot reads and moves them as it does real ones."""

from pathlib import Path

import numpy as np
import pytest

from hardware_emulated.feetech_bench import feetech_bench

pytestmark = pytest.mark.realtime  # other people's masters wait by the machine's clock

START = 0.4


def test_rustypot_reads_and_moves_the_servos(tmp_path: Path) -> None:
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
