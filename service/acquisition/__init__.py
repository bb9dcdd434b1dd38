"""Moving the arm: the run state machine, the control process, its guard and the recorder will stand here."""
