"""How a file is changed: byte by byte, line by line, number by number, key by key.

Every mutation takes the sound content and a generator of random numbers, and returns the changed content.
"""

import re
from collections.abc import Callable, Mapping
from random import Random
from types import MappingProxyType
from typing import Final

from .extremes import AMOUNTS, NUMBERS, PLAIN, UNITS

Mutation = Callable[[bytes, Random], bytes]

_NUMBER: Final = re.compile(rb"[-+]?\d+\.?\d*(?:[eEdD][-+]?\d+)?")
_VALUE: Final = re.compile(r"""(?<=[=\[,])\s*("[^"\n]*"|[-+]?[\d.][\w.+-]*|true|false)""")
_KEY: Final = re.compile(r"(?m)(?:^|(?<=[{,]))[ \t]*([A-Za-z_]\w*)(?=\s*=)")
_QUANTITY: Final = re.compile(r'"([-+]?\d[\d.eE+-]*) ([^"\s][^"]*)"')
_LONGEST: Final = 1 << 20


def flipped(data: bytes, random: Random) -> bytes:
    """One to eight bits."""
    out = bytearray(data)
    for _ in range(random.choice((1, 1, 2, 8))):
        at = random.randrange(len(out))
        out[at] ^= 1 << random.randrange(8)
    return bytes(out)


def overwritten(data: bytes, random: Random) -> bytes:
    """A run of bytes: zeros, ones or noise."""
    at, length = random.randrange(len(data)), random.choice((1, 4, 8, 64, 512))
    run = random.choice((b"\0" * length, b"\xff" * length, random.randbytes(length)))
    return (data[:at] + run + data[at + length :])[: len(data)]


def deleted(data: bytes, random: Random) -> bytes:
    """A run of bytes is missing."""
    at, length = random.randrange(len(data)), random.choice((1, 2, 8, 100, 1000))
    return data[:at] + data[at + length :]


def inserted(data: bytes, random: Random) -> bytes:
    """Bytes too many."""
    at, length = random.randrange(len(data) + 1), random.choice((1, 3, 20, 1000))
    return data[:at] + random.choice((random.randbytes(length), b"\n" * length, b"\0" * length)) + data[at:]


def truncated(data: bytes, random: Random) -> bytes:
    """The end is missing, down to nothing."""
    return data[: random.choice((0, 1, len(data) - 1, random.randrange(len(data)), random.randrange(len(data))))]


def duplicated(data: bytes, random: Random) -> bytes:
    """A part, or the whole, stands there twice."""
    a, b = sorted(random.randrange(len(data) + 1) for _ in range(2))
    return random.choice((data + data, data[:b] + data[a:b] + data[b:]))


BYTES: Final[Mapping[str, Mutation]] = MappingProxyType(
    {each.__name__: each for each in (flipped, overwritten, deleted, inserted, truncated, duplicated)}
)


def number_replaced(data: bytes, random: Random) -> bytes:
    """One to four number fields hold something extreme."""
    for _ in range(random.choice((1, 1, 1, 4))):
        data = _at_random(_NUMBER, data, random, lambda _: random.choice(NUMBERS).encode())
    return data


def number_scaled(data: bytes, random: Random) -> bytes:
    """A number times a power of ten, or a neighbour of it."""

    def scaled(found: bytes) -> bytes:
        value = float(found.lower().replace(b"d", b"e"))
        if b"." not in found:
            return str(int(value) + random.choice((-1, 1, 10, 1000, -100))).encode()
        return f"{value * random.choice((-1.0, 0.0, 1e3, 1e-3, 1e9, 1e-9, 1e30)):.9g}".encode()

    return _at_random(_NUMBER, data, random, scaled)


def line_lost(data: bytes, random: Random) -> bytes:
    """One to three lines are missing."""
    lines = data.split(b"\n")
    at = random.randrange(len(lines))
    del lines[at : at + random.choice((1, 1, 3))]
    return b"\n".join(lines)


def line_repeated(data: bytes, random: Random) -> bytes:
    """A line stands there again, somewhere."""
    lines = data.split(b"\n")
    lines.insert(random.randrange(len(lines) + 1), random.choice(lines))
    return b"\n".join(lines)


def lines_swapped(data: bytes, random: Random) -> bytes:
    """Two lines have changed places."""
    lines = data.split(b"\n")
    a, b = random.randrange(len(lines)), random.randrange(len(lines))
    lines[a], lines[b] = lines[b], lines[a]
    return b"\n".join(lines)


def line_endless(data: bytes, random: Random) -> bytes:
    """A line goes on for a hundred thousand characters."""
    lines = data.split(b"\n")
    at = random.randrange(len(lines))
    lines[at] += random.choice((b",1", b" 1", b"x", b"\t", b" ")) * 100_000
    return b"\n".join(lines)


TEXT: Final[Mapping[str, Mutation]] = MappingProxyType(
    {
        each.__name__: each
        for each in (number_replaced, number_scaled, line_lost, line_repeated, lines_swapped, line_endless)
    }
)


def value_replaced(data: bytes, random: Random) -> bytes:
    """A value of another type or kind."""
    return _in_text(_VALUE, data, random, lambda _: random.choice(PLAIN))


def quantity_replaced(data: bytes, random: Random) -> bytes:
    """A value with another amount, another unit, or both."""

    def other(found: str) -> str:
        amount, _, unit = found.strip('"').partition(" ")
        kind = random.randrange(3)
        new = random.choice(AMOUNTS) if kind != 1 else amount
        return f'"{new} {random.choice(UNITS) if kind else unit}"'

    return _in_text(_QUANTITY, data, random, other)


def quantity_scaled(data: bytes, random: Random) -> bytes:
    """One to three values times a power of ten: sound files of scenes that are enormous, tiny, or never end."""

    def scaled(found: str) -> str:
        amount, _, unit = found.strip('"').partition(" ")
        return f'"{float(amount) * 10.0 ** random.randint(-12, 12):.6g} {unit}"'

    for _ in range(random.choice((1, 1, 2, 3))):
        data = _in_text(_QUANTITY, data, random, scaled)
    return data


def whole_number_replaced(data: bytes, random: Random) -> bytes:
    """A count that is too large, zero or negative."""
    return _in_text(
        re.compile(r"(?<== )\d+(?=\s*$)", re.MULTILINE),
        data,
        random,
        lambda _: random.choice(("0", "-1", "1", "2", "3", "200", "1000", "1001", "2147483648", "9" * 20)),
    )


def key_renamed(data: bytes, random: Random) -> bytes:
    """A key with a slip of the pen, or another key's name."""
    keys = _KEY.findall(data.decode()) or ["a"]

    def other(found: str) -> str:
        stripped = found.strip()
        slip = stripped[:1] + stripped[2:] or "x"
        return random.choice((slip, stripped.upper(), random.choice(keys), f'"{stripped} "', f"{stripped}.x", '""'))

    return _in_text(_KEY, data, random, other)


def key_added(data: bytes, random: Random) -> bytes:
    """A key that nobody knows, or that stands there already; many of them."""
    lines = data.decode().split("\n")
    new = random.choice(
        (
            "surprise = 1",
            random.choice(lines),
            '"\\u0000" = 1',
            "a.b.c.d.e.f = { g = [ { h = 1 } ] }",
            "\n".join(f"k{k} = {k}" for k in range(3000)),
            "[seat.seat.seat]",
            "[[reed]]",
            "[" + "a." * 2000 + "a]",
            "a." * 2000 + "a = 1",
        )
    )
    lines.insert(random.randrange(len(lines) + 1), new)
    return "\n".join(lines).encode()


def table_moved(data: bytes, random: Random) -> bytes:
    """Headers of tables change places or names."""
    heads = re.findall(r"(?m)^\[.*\]$", data.decode()) or ["[a]"]
    return _in_text(
        re.compile(r"(?m)^\[.*\]$"), data, random, lambda found: random.choice([*heads, f"[{found}]", "[a]", ""])
    )


def values_swapped(data: bytes, random: Random) -> bytes:
    """One key has another's value."""
    values = [match[1] for match in _VALUE.finditer(data.decode())] or ["1"]
    return _in_text(_VALUE, data, random, lambda _: random.choice(values))


def many_at_once(data: bytes, random: Random) -> bytes:
    """Five of the others."""
    for _ in range(5):
        data = random.choice((value_replaced, quantity_replaced, key_renamed, values_swapped, table_moved))(
            data, random
        )
    return data


TOML: Final[Mapping[str, Mutation]] = MappingProxyType(
    {
        each.__name__: each
        for each in (
            value_replaced,
            quantity_replaced,
            quantity_scaled,
            whole_number_replaced,
            key_renamed,
            key_added,
            table_moved,
            values_swapped,
            many_at_once,
            line_lost,
        )
    }
)


def _at_random(pattern: re.Pattern[bytes], data: bytes, random: Random, new: Callable[[bytes], bytes]) -> bytes:
    places = list(pattern.finditer(data[:_LONGEST]))
    if not places:
        return data + new(b"1")
    match = random.choice(places)
    return data[: match.start()] + new(match[0]) + data[match.end() :]


def _in_text(pattern: re.Pattern[str], data: bytes, random: Random, new: Callable[[str], str]) -> bytes:
    text = data.decode()
    places = list(pattern.finditer(text))
    if not places:
        return data
    match = random.choice(places)
    group = 1 if match.re in (_VALUE, _KEY) else 0
    return (text[: match.start(group)] + new(match[group]) + text[match.end(group) :]).encode()
