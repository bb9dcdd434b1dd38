"""Other models beside the recordings: the robot file's, a saved one, a simulator's."""
