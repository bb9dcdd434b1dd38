"""What the model leaves out: localisation, the catalogue of effects, comparison and verdict will stand here."""
