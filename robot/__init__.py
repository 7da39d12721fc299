"""The Unitree H1 in MuJoCo."""
