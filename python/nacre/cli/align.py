def align() -> None:
    """x."""
