"""The walking robot: it follows a path."""
