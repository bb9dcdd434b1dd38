"""Which effects make the data most probable: candidates, hypotheses, and the way from one to the next."""
