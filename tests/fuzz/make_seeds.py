"""Write the inputs that the fuzz targets start from: `python tests/fuzz/make_seeds.py FOLDER`.

The targets read any bytes as numbers, sizes and choices, so that seeds are bytes by chance, low ones among
them, since those mean "as usual".
"""

import random
import sys
from pathlib import Path

NUMBER = 48


def main(folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    chance = random.Random(2010)
    for number in range(NUMBER):
        largest = (64, 200, 256)[number % 3]
        seed = bytes(chance.randrange(largest) for _ in range(32 << number % 5))
        (folder / f"{number:02d}").write_bytes(seed)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
