"""Write every hostile file: ``python tests/python/hostile_files FOLDER``."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from hostile_files import CASES, write

if __name__ == "__main__":
    for case in CASES.values():
        write(case, Path(sys.argv[1]))
    print(f"{len(CASES)} cases, {sum(len(case.files) for case in CASES.values())} files")
