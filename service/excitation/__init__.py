"""Which motion to ask for: Fourier series, their constraints and criteria, and the optimiser will stand here."""
