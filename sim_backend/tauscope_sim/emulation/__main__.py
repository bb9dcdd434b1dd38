"""``python -m tauscope_sim.emulation MODULE:ORDER JSON``: emulated devices, until standard input ends."""

import sys
from importlib import import_module

from tauscope_sim.emulation.server import EmulatorServer

if __name__ == "__main__":
    module, _, name = sys.argv[1].partition(":")
    EmulatorServer(getattr(import_module(module), name).from_json(sys.argv[2])).run()
