"""Every form of every effect beside a fitted model, each at its own best shape."""
