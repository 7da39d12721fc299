"""Foreign policy files, read as plain layers or as policies of our robot."""
