"""The page that people work with in a browser: static files of our own, no build step, nothing from elsewhere."""
