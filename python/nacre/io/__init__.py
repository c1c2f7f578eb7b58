"""Files: points, meshes, images, cameras and trajectories, in and out."""

import sys
from typing import Any


def __getattr__(name: str) -> Any:
    """Say where the functions are that users look for here."""
    if name.startswith("_"):
        raise AttributeError(f"module 'nacre.io' has no attribute {name!r}")
    from nacre._internal.guided import no_such_name
    from nacre._internal.names_elsewhere import OF_PACKAGE

    own = {word: f"it is nacre.{word}" for word in sys.modules["nacre"].__all__}
    raise no_such_name("nacre.io", name, (), own | OF_PACKAGE)
