"""Who may do what: API keys, the scope that each request needs, and how often it may come."""
