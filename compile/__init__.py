"""From a Nengo network to a chip image."""
