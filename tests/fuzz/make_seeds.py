"""Write the inputs that the fuzz targets start from: `python tests/fuzz/make_seeds.py FOLDER`.

The targets read any bytes as numbers, sizes and choices, so that seeds are bytes by chance, low ones among
them, since those mean "as usual": FOLDER/any. FOLDER/recording has those of fuzz_recording: by chance hardly
any goes on for long.
"""

import itertools
import random
import sys
from pathlib import Path

NUMBER = 48


def main(folder: Path) -> None:
    for kind in ("any", "recording"):
        (folder / kind).mkdir(parents=True, exist_ok=True)
    chance = random.Random(2010)
    for number in range(NUMBER):
        largest = (64, 200, 256)[number % 3]
        seed = bytes(chance.randrange(largest) for _ in range(32 << number % 5))
        (folder / "any" / f"{number:02d}").write_bytes(seed)
    # A few frames of each scene, and once around those that have enough shape, each with a focal length
    # that is right and with one that is not.
    walks = [*itertools.product(range(6), (0, 40), (4,)), *itertools.product(range(3), (0, 40), (17,))]
    for scene, focal, frames in walks:
        size, step, noise, mixing, color, options = 0, 152, 20, 0, 200 * (focal > 0), 0
        seed = bytes((scene, size, focal, step, noise, mixing, color, options, frames)) + bytes(2 * frames)
        (folder / "recording" / f"{scene}-{focal}-{frames}").write_bytes(seed)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
