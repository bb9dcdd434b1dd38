"""How probable what was measured is under a model: parameters integrated out, what is not known in one covariance."""
