"""Friction compensation: each joint's coefficients, ready for a controller, in joint torque and in drive units."""
