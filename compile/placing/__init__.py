"""Blocks onto cores: what they take, how they are cut, packed and bounded."""
