"""Deflection of transmissions as an encoder on the link shows it: compliance and play, without a torque residual."""
