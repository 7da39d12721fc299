"""The chip image: typed tables, their file, and the counts that follow from them."""
