"""CANopen drives of the profile CiA 402: power states, process data, and the driver over python-can."""
