"""Models of one robot over time: acceptance of new ones, drift and trends, the index and retention."""
