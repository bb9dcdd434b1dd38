"""What the rows' noise is, from the data and not from the fit."""
