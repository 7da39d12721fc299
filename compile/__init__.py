"""The compiler, from a Nengo network to a chip image."""
