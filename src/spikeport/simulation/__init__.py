"""A run of anybody's network on a chip, beside float Nengo."""
