"""What the selected model says: findings beside all others, where, how sure, what could not be seen, the verdict."""
