def consolidate() -> None:
    """x."""
