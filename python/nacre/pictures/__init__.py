"""Pictures as files, and the colours in them."""
