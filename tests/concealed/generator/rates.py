"""Rates and times that motions, passages and recordings share."""

RATE_HZ = 200.0
"""Of setpoints and of good recordings."""

HOLD_S = 0.5
"""Rest before the motion begins [s]."""

FINE = 5
"""Readings of the true state between two setpoints: 1 kHz."""
