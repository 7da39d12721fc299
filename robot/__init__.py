"""The Unitree H1 in MuJoCo: description, plant, arm kinematics and dynamics, pictures."""
