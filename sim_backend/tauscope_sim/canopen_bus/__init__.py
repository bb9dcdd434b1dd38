"""Emulated CiA 402 drives on an emulated CAN bus, moved by the simulated arm; shares no code with the driver."""
