"""Servos on one serial bus, whoever made them: the order of calls, the bus, its budget, and what doctor looks at."""
