"""What routes about jobs of every kind share: their state, their end, their events, how they are handed in."""
