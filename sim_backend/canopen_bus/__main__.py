"""``python -m sim_backend.canopen_bus ORDER``: emulated drives behind a serial adapter."""

import sys

from sim_backend.canopen_bus.order import CanOrder
from sim_backend.emulation.server import EmulatorServer

if __name__ == "__main__":
    EmulatorServer(CanOrder.from_json(sys.argv[1])).run()
