"""A run of a user's network on a chip, beside float Nengo."""
