"""Building and discretising by nengo-loihi: the only room that calls its builder."""
