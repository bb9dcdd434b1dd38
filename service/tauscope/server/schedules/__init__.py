"""What repeats at set times."""
