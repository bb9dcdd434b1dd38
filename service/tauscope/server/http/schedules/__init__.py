"""What is repeated at set times."""
