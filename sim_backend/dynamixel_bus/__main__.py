"""``python -m sim_backend.dynamixel_bus ORDER``: emulated servos on a pseudo terminal, until standard input ends."""

import sys

from sim_backend.dynamixel_bus.order import DynamixelOrder
from sim_backend.emulation.server import EmulatorServer

if __name__ == "__main__":
    EmulatorServer(DynamixelOrder.from_json(sys.argv[1])).run()
