"""What emulated buses have in common: a process of its own, a pseudo terminal, the arm they move, a kit of faults."""
