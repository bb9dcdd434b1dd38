"""The extended model fitted to rows: Gauss–Newton steps, what its columns hide, whether anything but noise is left."""
