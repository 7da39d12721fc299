"""A finished run as a page: robot, spikes, gates and errors on one time line."""
