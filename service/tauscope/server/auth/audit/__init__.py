"""Who did what and when: a file that only grows, every line chained to the one before."""
