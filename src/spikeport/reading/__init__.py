"""Files of others, read within limits: nothing of them is run, and no size is believed."""
