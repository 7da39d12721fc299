"""Where an image runs."""
