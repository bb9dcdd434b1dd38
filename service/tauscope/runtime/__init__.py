"""Moving the arm: the run state machine, the control process, its guard and the recorder.

`RunProcess` runs a motion in a process of its own, `run_trajectory` in this one; `recover_runs` shows, at the next
start, what became of runs whose process is gone.
"""
