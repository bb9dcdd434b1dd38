"""The service: HTTP, keys, the job queue, control of arms, history, schedules and the store below them."""
