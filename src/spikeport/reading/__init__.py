"""Readers of untrusted files: they work within limits, run nothing and check every size."""
