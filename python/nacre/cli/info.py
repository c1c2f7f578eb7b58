def info() -> None:
    """x."""
