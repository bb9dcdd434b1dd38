"""Models of each robot over time: which is active, what drifts, what people should know."""
