"""The Unitree H1 in MuJoCo: description, plant, arm kinematics and dynamics, pictures.

In reading order: `description` has the model and its joints, `plant` simulates it, and `state` is
its motion as controllers observe it. `perturbed_plant` has another body, floor or senses. `link`
puts the robot behind Unitree's interface, and `estimator` estimates its motion by its own sensors.
"""
