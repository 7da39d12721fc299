"""Estimators of the robot's motion from its own sensors; see docs/estimators.md."""
