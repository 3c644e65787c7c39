"""How a file is damaged: byte by byte, line by line, number by number, key by key.

Every mutation takes the sound content and a generator of random numbers, and returns the damaged content.
"""

import re
from collections.abc import Callable, Mapping
from pathlib import Path
from random import Random
from typing import Final

from impact.storage.hdf5 import USER_BLOCK, seal_of

NUMBERS: Final = (
    "nan", "inf", "-inf", "0", "-0.0", "-1", "1e308", "1e-308", "5e-324", "1e999", "1" * 400, "9223372036854775808",
    "4294967296", "2147483648", "1e20", "1e-20", "1e6", "3.7", "", "abc", "1,5", "1e", "--1", "0x10", "１", "1d3",
    "1_000", "+", "\x00", "é", "2", "3", "1000",
)  # fmt: skip
VALUES: Final = (
    "nan", "-inf", "0", "-1", "1e308", "1e999", "true", '""', '" "', "[]", "{}", "[[]]", "[{}]", "07:32:00", "9" * 30,
    "9" * 5000, '"nan"', '"\\u0000"', '"\\u202E mm"', '"../../etc/passwd"', '"/"', '"/dev/null"', '"scene.toml"',
    '"' + "x" * 5000 + '"', "[" + "1," * 20000 + "]", "[" * 3000 + "]" * 3000, "{a=" * 3000 + "1" + "}" * 3000,
    '"1 m' + " " * 20000 + '!"', '"' + "1/" * 5000 + 's"', '"' + "9" * 100000 + ' mm"', "2", "1000", "-5", '"auto"',
    '"1 %"', '"100 %"', '"1e-12 %"', "0.5",
)  # fmt: skip
AMOUNTS: Final = ("0", "-1", "1e-300", "1e300", "1e999", "nan", "inf", "1e12", "1e-12", "1e6", "1e-6", "1e3", "1e-3")
UNITS: Final = ("mm", "um", "km", "parsec", "us", "year", "kg", "N/um", "GPa", "MHz", "m/s", "deg", "%", "m^9", "mm mm")
PLACED: Final = (
    "surprise = 1", '"\\u0000" = 1', "\n".join(f"k{k} = {k}" for k in range(3000)), "[seat.seat.seat]", "[[reed]]",
    "[" + "a." * 2000 + "a]", "a." * 2000 + "a = 1",
)  # fmt: skip
_NUMBER: Final = re.compile(r"[-+]?\d+\.?\d*(?:[eEdD][-+]?\d+)?")
_VALUE: Final = re.compile(r"""(?<=[=\[,])\s*("[^"\n]*"|[-+]?[\d.][\w.+-]*|true|false)""")
_KEY: Final = re.compile(r"(?m)(?:^|(?<=[{,]))[ \t]*[A-Za-z_]\w*(?=\s*=)")
_QUANTITY: Final = re.compile(r'"[-+]?\d[\d.eE+-]* [^"\s][^"]*"')
_HEAD: Final = re.compile(r"(?m)^\[.*\]$")
Mutation = Callable[[bytes, Random], bytes]


def flipped(data: bytes, random: Random) -> bytes:
    out = bytearray(data)
    for _ in range(random.choice((1, 1, 2, 8))):
        out[random.randrange(len(out))] ^= 1 << random.randrange(8)
    return bytes(out)


def overwritten(data: bytes, random: Random) -> bytes:
    at, length = random.randrange(len(data)), random.choice((1, 4, 8, 64, 512))
    run = random.choice((b"\0" * length, b"\xff" * length, random.randbytes(length)))
    return (data[:at] + run + data[at + length :])[: len(data)]


def deleted(data: bytes, random: Random) -> bytes:
    at = random.randrange(len(data))
    return data[:at] + data[at + random.choice((1, 2, 8, 100, 1000)) :]


def inserted(data: bytes, random: Random) -> bytes:
    at, length = random.randrange(len(data) + 1), random.choice((1, 3, 20, 1000))
    return data[:at] + random.choice((random.randbytes(length), b"\n" * length, b"\0" * length)) + data[at:]


def truncated(data: bytes, random: Random) -> bytes:
    return data[: random.choice((0, 1, len(data) - 1, random.randrange(len(data)), random.randrange(len(data))))]


def doubled(data: bytes, random: Random) -> bytes:
    a, b = sorted(random.randrange(len(data) + 1) for _ in range(2))
    return random.choice((data + data, data[:b] + data[a:]))


def lines_changed(data: bytes, random: Random) -> bytes:
    """Lines are lost, or one stands there twice or elsewhere, or goes on for a hundred thousand characters."""
    lines = data.split(b"\n")
    at, kind = random.randrange(len(lines)), random.randrange(4)
    if kind == 0:
        del lines[at : at + random.choice((1, 1, 3))]
    elif kind == 1:
        lines.insert(random.randrange(len(lines) + 1), lines[at])
    elif kind == 2:
        lines.insert(random.randrange(len(lines)), lines.pop(at))
    else:
        lines[at] += random.choice((b",1", b" 1", b"x", b"\t", b" ")) * 100_000
    return b"\n".join(lines)


def _in_text(pattern: re.Pattern[str], new: Callable[[str, Random], str]) -> Mutation:
    """Return the mutation that replaces one to three places of a pattern."""

    def changed(data: bytes, random: Random) -> bytes:
        text = data.decode()
        for _ in range(random.choice((1, 1, 1, 3))):
            if places := list(pattern.finditer(text)):
                place = random.choice(places)
                text = text[: place.start()] + new(place[0], random) + text[place.end() :]
        return text.encode()

    return changed


def _scaled(number: str, random: Random) -> str:
    """Return another number of about that form: a neighbour, or a multiple by a power of ten."""
    if number.lstrip("+-").isdecimal():
        return str(int(number[:300]) + random.choice((-1, 1, 10, 1000, -100)))
    value = float(number.lower().replace("d", "e"))
    return f"{value * random.choice((-1.0, 0.0, 1e3, 1e-3, 1e9, 1e-9, 1e30)):.9g}"


def _other_quantity(text: str, random: Random) -> str:
    amount, _, unit = text.strip('"').partition(" ")
    kind = random.randrange(4)
    if kind == 3:
        return f'"{float(amount) * 10.0 ** random.randint(-12, 12):.6g} {unit}"'
    return f'"{random.choice(AMOUNTS) if kind != 1 else amount} {random.choice(UNITS) if kind else unit}"'


def _slip(key: str, random: Random) -> str:
    return random.choice((key[:1] + key[2:] or "x", key.upper(), f'"{key.strip()} "', f"{key}.x", '""'))


def placed(data: bytes, random: Random) -> bytes:
    """A line that nobody knows, somewhere, or thousands of them."""
    lines = data.decode().split("\n")
    lines.insert(random.randrange(len(lines) + 1), random.choice((*PLACED, random.choice(lines))))
    return "\n".join(lines).encode()


BYTES: Final[Mapping[str, Mutation]] = {
    each.__name__: each for each in (flipped, overwritten, deleted, inserted, truncated, doubled)
}
TEXT: Final[Mapping[str, Mutation]] = {
    "number_replaced": _in_text(_NUMBER, lambda _, random: random.choice(NUMBERS)),
    "number_scaled": _in_text(_NUMBER, _scaled),
    "lines_changed": lines_changed,
}
TOML: Final[Mapping[str, Mutation]] = {
    "value_replaced": _in_text(_VALUE, lambda _, random: random.choice(VALUES)),
    "quantity_replaced": _in_text(_QUANTITY, _other_quantity),
    "key_renamed": _in_text(_KEY, _slip),
    "table_moved": _in_text(_HEAD, lambda head, random: random.choice((f"[{head}]", "[a]", "", "[run]", "[seat]"))),
    "placed": placed,
    "lines_changed": lines_changed,
}


def seal(path: Path) -> None:
    """Write the checksum of a closed file with a user block into that block."""
    with path.open("r+b") as file:
        file.seek(USER_BLOCK)
        block = seal_of(file.read())
        file.seek(0)
        file.write(block)
