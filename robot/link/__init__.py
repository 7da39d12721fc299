"""The H1 behind Unitree's interface: messages, bus, the robot's process; see docs/robot.md."""
