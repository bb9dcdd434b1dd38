"""What operators look at: logs, metrics, readiness, and the word that the service gives to systemd."""
