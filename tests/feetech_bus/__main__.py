"""``python -m feetech_bus ORDER``: emulated servos on a pseudo terminal, until standard input ends."""

import sys

from feetech_bus.order import FeetechOrder
from tauscope_sim.emulation.server import EmulatorServer

if __name__ == "__main__":
    EmulatorServer(FeetechOrder.from_json(sys.argv[1])).run()
