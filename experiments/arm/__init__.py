"""The arm: it reaches for targets, and draws digits."""
