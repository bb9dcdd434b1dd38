"""Work that takes time: jobs in worker processes, runs in control processes, campaigns that put them together."""
