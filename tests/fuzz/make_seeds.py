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
    # Once around each scene, with a focal length that is right and with one that is not.
    for scene, focal in itertools.product(range(6), (0, 40)):
        size, step, noise, mixing, color, options, frames = scene % 3, 80, 20, 0, 200 * (focal > 0), 0, 40
        seed = bytes((scene, size, focal, step, noise, mixing, color, options, frames)) + bytes(2 * frames)
        (folder / "recording" / f"{scene}-{focal}").write_bytes(seed)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
