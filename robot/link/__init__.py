"""The robot's interface: its signals, and the states of what controls it."""
