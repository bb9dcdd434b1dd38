"""``python -m tauscope_sim.dynamixel_bus ORDER``: emulated servos on a pseudo terminal, until standard input ends."""

import sys

from tauscope_sim.dynamixel_bus.order import DynamixelOrder
from tauscope_sim.emulation.server import EmulatorServer

if __name__ == "__main__":
    EmulatorServer(DynamixelOrder.from_json(sys.argv[1])).run()
