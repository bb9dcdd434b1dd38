"""``python -m tauscope_sim.canopen_bus ORDER``: emulated drives behind a serial adapter."""

import sys

from tauscope_sim.canopen_bus.order import CanOrder
from tauscope_sim.emulation.server import EmulatorServer

if __name__ == "__main__":
    EmulatorServer(CanOrder.from_json(sys.argv[1])).run()
