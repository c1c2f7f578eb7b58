"""The library that closes surfaces and simplifies them."""

from __future__ import annotations

import warnings
from typing import Any


def gpytoolbox(purpose: str, extra: str) -> Any:
    """Return gpytoolbox, or say what needs it, and which extra of nacre installs it."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)  # its own
            import gpytoolbox as library
    except ImportError as error:
        message = f'{purpose} need gpytoolbox: pip install "nacre[{extra}]"'
        raise ImportError(message, name="gpytoolbox") from error
    return library
