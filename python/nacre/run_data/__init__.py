"""A run: its frames, as they were registered and as they are reported, and what is saved of it."""
