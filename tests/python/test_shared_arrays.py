"""Arrays that another thread writes to while a call reads them, as drivers of cameras do: no harm is done."""

import contextlib
import os
import subprocess
import sys
import threading
import time
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))
from recipes import RECIPES, Recipe, arrays_of

VALUES = np.array([np.nan, np.inf, 0.0, 1e-30, 1e30, 3e38, -1.0, 0.5])
SECONDS = 0.2


def enlarged(array: Any) -> Any:
    """Return a copy of an array; of points, with every row many times."""
    return np.concatenate([array] * 40) if array.ndim and len(array) in (20, 50, 60) else array.copy()


def write_to(arrays: list[Any], ended: threading.Event) -> None:
    """Make arrays invalid here and there, and valid again, over and over."""
    before = [array.copy() for array in arrays]
    random = np.random.default_rng(0)
    while not ended.is_set():
        for array, whole in zip(arrays, before, strict=True):
            some = random.integers(0, array.size, 1 + array.size // 20)
            if array.dtype.kind == "f" and random.random() < 0.6:
                with np.errstate(over="ignore"):
                    array.reshape(-1)[some] = np.nan if random.random() < 0.5 else random.choice(VALUES)
            elif array.dtype.kind in "biu" and random.random() < 0.3:
                array.reshape(-1)[some] = random.integers(0, 2)
            else:
                array[...] = whole


def call_meanwhile(recipe: Recipe) -> None:
    arguments = dict(recipe.arguments)
    shared = [name for name in arrays_of(recipe) if arguments[name].size]
    arguments |= {name: enlarged(arguments[name]) for name in shared}
    if "num_samples" in arguments:
        arguments["num_samples"] *= 40
    recipe.call(**arguments)  # with whole arrays it is a valid call
    ended = threading.Event()
    other = threading.Thread(target=write_to, args=([arguments[name] for name in shared], ended))
    other.start()
    end = time.monotonic() + SECONDS
    try:
        while time.monotonic() < end:
            with contextlib.suppress(Exception):
                recipe.call(**arguments)
    finally:
        ended.set()
        other.join()


NAMES = [name for name, recipe in RECIPES.items() if arrays_of(recipe)]


@pytest.mark.parametrize("module", sorted({name.split(".")[1] for name in NAMES}))
def test_nothing_is_harmed(module: str) -> None:
    names = [name for name in NAMES if name.split(".")[1] == module]
    done = subprocess.run(
        [sys.executable, __file__, *names],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "MALLOC_PERTURB_": "165"},  # what is read beyond an array is no number
    )
    assert done.returncode == 0, f"{done.stdout.split()[-1]} ended the process: {done.stderr}"
    assert done.stdout.split() == names


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    sys.setswitchinterval(1e-5)
    for name in sys.argv[1:]:
        print(name, flush=True)
        call_meanwhile(RECIPES[name])
