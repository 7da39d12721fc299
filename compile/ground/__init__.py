"""The ground the rooms of compile stand on: names, settings and refusals of a network."""
