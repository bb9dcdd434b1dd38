"""Arm physics for tests, demonstrations and the simulated backend; the multibody dynamics are MuJoCo's.

Nothing of service's dynamics, identification or diagnosis is imported here: the judge and the judged share no formula.
"""
