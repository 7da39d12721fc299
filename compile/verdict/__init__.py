"""Whether a network fits, what it costs, what rounding loses, and the report that says so."""
