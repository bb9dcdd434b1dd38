"""Leases over HTTP: taken, kept by a heartbeat, armed, given back; and the stop that needs none."""
