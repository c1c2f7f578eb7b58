"""A recording is cut into overlapping pieces, which processes of a Dask cluster track at once."""
