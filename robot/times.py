"""Times of the simulated robot."""

PHYSICS_DT_S = 0.005
"""The physics step, as in h1.xml."""
ROUNDING_S = 1e-6
"""The error that a time of the robot, the sum of its steps, may have: 2e-8 s after 2,000 s."""
