"""Feetech STS3215 servos on a serial bus: position mode."""
