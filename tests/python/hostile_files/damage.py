"""Damage at random: what bytes become on bad disks, in bad hands and by bad programs."""

from __future__ import annotations

import random
from collections.abc import Sequence

WORDS = (
    b"-1", b"0", b"1e400", b"nan", b"inf", b"1_0", b"\0", b"\xff\xff\xff\xff", b"\0\0\0\x80", b"4294967296",
    b"9223372036854775807", b"\r\n", b"\n", b"[", b"{", b'"', b"../", b"/", b"#", b" ",
)  # fmt: skip


def scratched(seeds: Sequence[bytes], chance: random.Random) -> bytes:
    """Return one of the seeds with one digit or one bit changed: the damage that is hardest to see."""
    data = bytearray(chance.choice(seeds))
    digits = [at for at, value in enumerate(data) if 48 <= value < 58]
    if digits and chance.random() < 0.5:
        data[chance.choice(digits)] = 48 + chance.randrange(10)
    elif data:
        data[chance.randrange(len(data))] ^= 1 << chance.randrange(8)
    return bytes(data)


def damaged(seeds: Sequence[bytes], chance: random.Random) -> bytes:
    """Return one of the seeds with one to four pieces flipped, cut, doubled or replaced."""
    data = chance.choice(seeds)
    for _ in range(chance.randint(1, 4)):
        at = chance.randint(0, len(data))
        length = min(len(data) - at, chance.choice((1, 1, 2, 4, 8, 64)))
        kind = chance.randrange(7)
        if kind == 0 and length:
            data = data[:at] + bytes([data[at] ^ 1 << chance.randrange(8)]) + data[at + 1 :]
        elif kind == 1:
            data = data[:at]
        elif kind == 2:
            data = data[:at] + data[at + length :]
        elif kind == 3:
            data = data[: at + length] + data[at:]
        elif kind == 4:
            data = data[:at] + chance.choice(WORDS) + data[at + length :]
        elif kind == 5:
            data = data[:at] + chance.randbytes(length) + data[at + length :]
        else:
            other = chance.choice(seeds)
            data = data[:at] + other[chance.randint(0, len(other)) :]
    return data
