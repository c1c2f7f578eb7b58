"""Hostile trajectories: TUM, Redwood's .log, 7-Scenes, matrices."""

import numpy as np

from hostile_files.case import single

GOOD = "0 0 0 0 0 0 0 1\n"
EYE = "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n"
_random = np.random.default_rng(4)

TUM = {
    "tum empty": ("", "the trajectory is empty"),
    "tum of comments": ("# nothing\n" * 1000, "the trajectory is empty"),
    "tum nul bytes": ("\0" * 300, "line 1"),
    "tum word": (GOOD + "1 0 0 zero 0 0 0 1\n", "line 2: expected numbers"),
    "tum nan": (GOOD + "1 nan 0 0 0 0 0 1\n", "line 2: expected finite numbers"),
    "tum time infinite": ("inf 0 0 0 0 0 0 1\n", "line 1: expected finite numbers"),
    "tum 1e400": (GOOD + "1 1e400 0 0 0 0 0 1\n", "line 2: expected finite numbers"),
    "tum position 1e300": (
        GOOD + "1 0 -1e300 0 0 0 0 1\n",
        "line 2: the position is more than 1e.30 m",
    ),
    "tum underscore": (GOOD + "1_0 0 0 0 0 0 0 1\n", "line 2: expected numbers"),
    "tum arabic digits": (GOOD + "\u0661 0 0 0 0 0 0 1\n", "line 2: expected numbers"),
    "tum comma": ("0,0,0,0,0,0,0,1\n", "line 1: expected numbers"),
    "tum value short": (GOOD + "1 0 0 0 0 0 1\n", "line 2: expected 8 numbers"),
    "tum value short in the first line": ("1 2 3 4 5 6 7\n", "line 1: expected"),
    "tum value short after a comment": ("# a\n" + GOOD + "2 0 0 0 0 0 0\n", "line 3: expected 8 numbers"),
    "tum value more": (GOOD + "1 0 0 0 0 0 0 1 9\n", "line 2: expected 8 numbers"),
    "tum cut in the last line": (GOOD * 2 + "2 0 0 0 0 0", "line 3: expected 8 numbers"),
    "tum quaternion of zero length": (GOOD + "1 0 0 0 0 0 0 0\n", "line 2: the quaternion is 0"),
    "tum number of 100000 digits": (
        GOOD + "9" * 100_000 + " 0 0 0 0 0 0 1\n",
        "line 2: .*a line of 100015 bytes",
    ),
    "tum of one endless line": ("0 " * 60_000, "line 1: .*a line of 120000 bytes"),
}
LOG = {
    "log header short": ("0 0\n" + EYE, "line 1"),
    "log header of words": ("a b c\n" + EYE, "line 1: expected numbers"),
    "log index a fraction": ("0.5 0 1\n" + EYE, "line 1: .*whole"),
    "log matrix cut": ("0 0 1\n" + EYE[:24], "the last 4x4 matrix is cut off|line"),
    "log matrix with a row short": (
        "0 0 1\n" + EYE.replace("0 1 0 0", "0 1 0"),
        "line 3: expected 4 numbers",
    ),
    "log matrix of zeros": ("0 0 1\n" + EYE.replace("1", "0"), "line 2: .*not a rotation"),
    "log matrix mirrors": ("0 0 1\n" + EYE.replace("0 1 0 0", "0 -1 0 0"), "line 2: .*not a rotation"),
    "log matrix scales": ("0 0 1\n" + EYE.replace("1 0 0 0", "2 0 0 0"), "line 2: .*not a rotation"),
    "log matrix with a wrong last row": (
        "0 0 1\n" + EYE.replace("0 0 0 1", "0 0 1 1"),
        "line 2: .*not a rot",
    ),
    "log matrix nan": ("0 0 1\n" + EYE.replace("0 1 0 0", "0 nan 0 0"), "line 3: expected finite"),
    "log matrix 1e308": ("0 0 1\n" + EYE.replace("0 1 0 0", "0 1e308 1e308 0"), "line 2: .*not a rotation"),
    "log without matrices": ("0 0 1\n" * 20_000, "line 2: expected 4 numbers"),
    "log second header short": ("0 0 1\n" + EYE + "1 1\n" + EYE, "line 6: expected"),
    "log matrix of two rows": ("0 0 1\n1 0 0 0\n0 1 0 0\n", "cut off"),
    "log second matrix missing": ("0 0 1\n" + EYE + "1 1 2\n", "cut off"),
}
OTHER = {
    "pose of three rows": ("\n".join(EYE.split("\n")[:3]), "line 1: expected lines of 8 numbers"),
    "pose of five rows": (EYE + "0 0 0 1\n", "line 1: expected lines of 8 numbers"),
    "pose of one number": ("1\n", "line 1: expected lines of 8 numbers"),
    "pose mirrors": (EYE.replace("0 0 1 0", "0 0 -1 0"), "line 1: .*not a rotation"),
    "pose scales": ("2 0 0 0\n0 2 0 0\n0 0 2 0\n0 0 0 1\n", "line 1: .*not a rotation"),
    "pose with a wrong last row": (EYE.replace("0 0 0 1", "0 0 1 1"), "line 1: .*not a rotation"),
    "pose no rotation": (EYE.replace("1 0 0 0", "1 1 0 0"), "line 1: .*not a rotation"),
}
BYTES = {
    "tum utf-16": (GOOD.encode("utf-16"), "not text|line 1"),
    "tum garbage": (_random.bytes(2000), "not text|line"),
    "tum latin-1": (GOOD.encode() + b"# gr\xfc\xdf\n1 x\n", "line 3|not text"),
    "tum nul in a number": (GOOD.encode() + b"1 0\0 0 0 0 0 0 1\n", "line 2: expected numbers"),
}


TRAJECTORIES = (
    single("trajectory", "trajectory", ".txt", TUM | BYTES)
    + single("trajectory", "trajectory", ".log", LOG)
    + single("trajectory", "trajectory", ".pose.txt", OTHER)
    + single("trajectory", "matrix", ".mat", {"matrix of two poses": (GOOD + "1" + GOOD[1:], "2 poses")})
)
