"""Rules and limits: what a network breaks, and what compiles but is lost."""
