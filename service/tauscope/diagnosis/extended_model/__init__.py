"""The model with its findings as something to keep: saved, read again, written as code, and for the simulated arm."""
