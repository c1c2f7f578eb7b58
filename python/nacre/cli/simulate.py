def simulate() -> None:
    """x."""
