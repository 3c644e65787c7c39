"""The kinds of values a scene key may hold: strings with units become SI floats."""

import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from copy import copy
from dataclasses import dataclass, fields
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, Self, TypeVar, Union, get_args, get_origin

from annotated_types import Ge, Gt, Lt
from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, ValidationInfo, model_validator
from pydantic.fields import FieldInfo
from pydantic.types import Discriminator

from impact.files.safe_files import MB, check_file
from impact.notices import SeatfemError
from seatfem.units import (
    DIMENSIONS,
    UnitError,
    ask_for_prefix,
    number_and_unit,
    parse_fraction,
    parse_quantity,
    parse_rpm,
    with_unit,
    write_quantity,
)

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

FILE_LIMIT = 8192 * MB
GROUPS = ("reeds", "seats", "strikers", "imported")
"""Groups of kinds of structures, in the order in which lists show them."""
Made = TypeVar("Made", bound="DataclassInstance")
Contradictions = Iterator[tuple[str, str]]
"""Pairs of a key to change and the reason."""


class KeyProblem(SeatfemError, ValueError):
    """A check across several keys failed; `key` (dotted, relative to the table) is the one to change."""

    def __init__(self, key: str, message: str) -> None:
        super().__init__(message)
        self.key = key


@contextmanager
def keys_of(table: str) -> Iterator[None]:
    """Prefix the key of a `KeyProblem` that is raised within with the name of its ``table``."""
    try:
        yield
    except KeyProblem as problem:
        raise KeyProblem(f"{table}.{problem.key}".rstrip("."), str(problem)) from None


def within(table: str, contradictions: Iterable[tuple[str, str]]) -> Contradictions:
    """Yield contradictions with the name of their ``table`` before each key."""
    yield from ((f"{table}.{key}", words) for key, words in contradictions)


@contextmanager
def problem_of(key: str, *errors: type[Exception], drop: str = "") -> Iterator[None]:
    """Raise ``errors`` from within as a `KeyProblem` of the ``key``, their messages without the prefix ``drop``."""
    try:
        yield
    except errors as error:
        raise KeyProblem(key, str(error).removeprefix(drop)) from None


class Table(BaseModel):
    """A table of the scene: every key is known, and nothing changes after reading."""

    model_config = ConfigDict(frozen=True, extra="forbid", validate_default=True, allow_inf_nan=False, defer_build=True)

    sample: ClassVar[str] = ""
    """Lines of TOML with which `seatfem init` begins a table of this class, its required keys among them."""

    inlined: ClassVar[str] = ""
    """Name of a field whose own keys are written directly in this table."""

    also: ClassVar[Mapping[str, tuple[str, ...]]] = MappingProxyType({})
    """Names of other kinds, each with keys of this one: a table with such a name and one of these keys means this
    kind."""

    former: ClassVar[Mapping[str, str]] = MappingProxyType({})
    """Keys that are no more, and what to do about each."""

    def given_keys(self, *keys: str) -> list[str]:
        """Return those of the ``keys`` that have a value."""
        return [key for key in keys if getattr(self, key) is not None]

    def contradictions(self) -> Contradictions:
        """Yield the keys to change, and why, where several together are wrong; the first of them is reported."""
        yield from ()

    def doubts(self) -> Contradictions:
        """Yield keys whose values are possible together but unusual, and why: a scene is warned before it is run."""
        yield from ()

    @model_validator(mode="after")
    def _check_contradictions(self) -> Self:
        for key, words in self.contradictions():
            raise KeyProblem(key, words)
        return self

    def check_one_of(self, keys: tuple[str, ...], nothing: str) -> None:
        """Raise `KeyProblem` unless exactly one of the ``keys`` has a value; ``nothing``: message where none has."""
        if len(given := self.given_keys(*keys)) != 1:
            words = f"{' and '.join(given)} are given" if given else nothing
            raise KeyProblem(given[1] if given else keys[0], f"{words}: give exactly one of {', '.join(keys)}")


def build_from_fields(made: type[Made], *tables: Table, **others: object) -> Made:
    """Return a dataclass whose fields take the values of the keys of the same names, in the first table that has one.

    ``others``: fields that are called or written otherwise. A key that is ``None`` leaves the field's own default.
    """
    names = {field.name for field in fields(made)}
    values: dict[str, Any] = {
        key: value
        for table in reversed(tables)
        for key in names & type(table).model_fields.keys()
        if (value := getattr(table, key)) is not None
    }
    return made(**values | others)


AnyTable = TypeVar("AnyTable", bound=Table)


def kind_of(table: type[BaseModel]) -> str:
    """Return the name of a table among others in its place, its ``kind: Literal["name"]``; "" where it has none."""
    field = table.model_fields.get("kind")
    annotation = None if field is None else field.annotation
    return str(get_args(annotation)[0]) if get_origin(annotation) is Literal else ""


def kinds_below(base: type[AnyTable]) -> tuple[type[AnyTable], ...]:
    """Return every subclass with a kind, however deep, in the order of their definition."""
    kinds: list[type[AnyTable]] = []
    for each in base.__subclasses__():
        kinds += [*([each] if kind_of(each) else []), *kinds_below(each)]
    return tuple(dict.fromkeys(kinds))


def kinds_in_words(kinds: Iterable[type[BaseModel]]) -> str:
    """Return the names of kinds, those of one ``group`` together: "reeds: cantilever, flapper; seats: annular"."""
    listed = {name: ", ".join(map(kind_of, group)) for name, group in by_group(kinds).items()}
    return "; ".join(f"{name}: {names}" if name else names for name, names in listed.items())


def by_group(kinds: Iterable[type[BaseModel]]) -> dict[str, list[type[BaseModel]]]:
    """Return kinds by their ``group``, in the order of `GROUPS`; those without one under ""."""
    groups: dict[str, list[type[BaseModel]]] = {name: [] for name in GROUPS}
    for each in kinds:
        groups.setdefault(getattr(each, "group", ""), []).append(each)
    return {name: group for name, group in groups.items() if group}


def one_of(kinds: tuple[type[Table], ...]) -> Any:
    """Return the annotation of a key that holds one of these tables, by their ``kind``, and what is ``also``."""

    def correct_kind(given: object) -> object:
        if not isinstance(given, Mapping) or not isinstance(kind := given.get("kind"), str):
            return given
        meant = (kind_of(each) for each in kinds if given.keys() & set(each.also.get(kind, ())))
        return {**given, "kind": next(meant, kind)}

    if len(kinds) == 1:
        return Annotated[kinds[0], BeforeValidator(correct_kind)]
    return Annotated[Union[kinds], Discriminator("kind"), BeforeValidator(correct_kind)]  # noqa: UP007


def field_of(model: type[BaseModel], name: str) -> FieldInfo:
    """Return a field of a model for another with another annotation: a copy, without what its annotation adds."""
    field = copy(model.model_fields[name])
    field.metadata = []
    return field


def default(written: object, description: str, example: object = None, **limits: Any) -> Any:
    """Return a field's default, and an example, as a user writes them; the default is read like any value."""
    if example is not None:
        limits["examples"] = [example]
    return Field(written, description=description, **limits)


def absent(description: str, **limits: Any) -> Any:
    """Return a field that need not be stated, and then has the value ``None``."""
    return Field(None, description=description, **limits)


@dataclass(frozen=True)
class ReadQuantity:
    """Reader of a string with a unit. Refuses bare numbers, which nobody can know the meaning of, and insane ones.

    The ranges keep every product of a few values far from overflow.
    """

    dimension: str

    def __call__(self, value: object) -> float:
        wanted = DIMENSIONS[self.dimension]
        if isinstance(value, int | float) and not isinstance(value, bool):
            raise UnitError(f"{value!r} has no unit; write {with_unit(value, self.dimension)!r}, a number and its unit")
        if not isinstance(value, str):
            raise UnitError(f"{value!r} is no {wanted.name}; write a number and its unit, e.g. {wanted.example!r}")
        number, (least, most) = parse_quantity(value, self.dimension), wanted.sane
        if number == 0.0 or least <= abs(number) <= most:
            return number
        meant = ask_for_prefix(number, self.dimension)
        raise UnitError(f"{value!r} is out of any sane range: {least:g} to {most:g} {wanted.si}{meant}")


@dataclass(frozen=True)
class Usual:
    """Range [SI] of the values that a key usually has, instead of that of its dimension; a scene is warned of
    others."""

    least: float
    most: float


def read_number(value: object, parse: Callable[[str], float] = parse_fraction, example: str = "0.1 or '10 %'") -> float:
    """Read a number, or the text that ``parse`` knows: 0.1 or "10 %"."""
    if isinstance(value, str):
        return parse(value)
    if isinstance(value, int | float) and not isinstance(value, bool):
        return float(value)
    raise UnitError(f"{value!r} is not a number; write {example}")


def read_rpm(value: object) -> float:
    """Read a speed of a crank in turns a minute: 3000 or "3000 1/min"."""
    return read_number(value, parse_rpm, "3000 or '3000 1/min'")


def read_temperature(value: object) -> float:
    """Read a temperature such as "120 degC" or "393 K" [K]."""
    text = value.strip() if isinstance(value, str) and "%" not in value else ""
    for unit, zero in (("degC", 273.15), ("K", 0.0)):
        if text.endswith(unit):
            return parse_fraction(text.removesuffix(unit)) + zero
    raise UnitError(f"{value!r} is no temperature; write '120 degC' or '393 K'")


Value = Any
"""A value as it is written in a scene file: "0.3 mm", 5, "signorini"."""


def read_written(value: object) -> tuple[float, str]:
    """Return the number and the unit of a written quantity."""
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        raise ValueError(f"{value!r} is no number; write one with its unit, e.g. '0.3 mm', or a pure one")
    number, unit = number_and_unit(value)
    if not math.isfinite(number):
        raise ValueError(f"{value!r} must be finite")
    return number, unit


def _cited(value: str) -> str:
    if not value.strip():
        raise ValueError("is empty: measured numbers need a citation, as of a report, a standard or a data sheet")
    return value


def _moving(value: float) -> float:
    """Return a velocity [m/s] that is not zero: negative towards the seat, positive towards a stopper."""
    if value == 0.0:
        raise ValueError("a mass at rest never touches the seat; give it a velocity towards it, as '-2 m/s'")
    return value


def flies_away(velocity: float, key: str, remedy: str = "") -> Contradictions:
    """Yield a contradiction of the ``key`` if a ``velocity`` [m/s] is not towards the seat."""
    if velocity > 0:
        towards = f"velocities towards the seat are negative, write '-{write_quantity(velocity, 'velocity')}'"
        yield key, f"it would fly away: {towards}{remedy}"


def _open(value: float) -> float:
    """Return the opening of a contact [m], which must not be negative: bodies do not overlap at the start, and a
    preload is a key of its own."""
    if value >= 0.0:
        return value
    raise ValueError(
        f"{write_quantity(value, 'length')} must be >= 0 mm: bodies do not overlap at the start. A reed that is "
        'pressed on its seat has gap = "0 mm", contact.preload = true and the load that presses it ([[load]])'
    )


def _existing_file(value: Path, info: ValidationInfo) -> Path:
    """Return the path of a file that exists. Relative paths start at the folder of the scene file, the validation
    context's "folder"; with "unread" the file need not exist yet."""
    context = info.context or {}
    path: Path = context.get("folder", Path()) / value
    if context.get("unread"):
        return path
    try:
        check_file(path, FILE_LIMIT, ValueError)
    except FileNotFoundError:
        seen = "name one that is there, as seen from the folder of this file"
        if re.fullmatch(r"[\d.]+ *[A-Za-z/]*", str(value)):
            seen = f"write the number into a file, and {seen}"
        raise ValueError(f"no such file: {path}; {seen}") from None
    return path.resolve()


WrittenQuantity = Annotated[tuple[float, str], BeforeValidator(read_written)]
"""Number and unit of a quantity of any dimension."""
Length = Annotated[float, BeforeValidator(ReadQuantity("length")), Gt(0)]
Thickness = Annotated[float, BeforeValidator(ReadQuantity("length")), Gt(0), Usual(1e-5, 0.03)]
Position = Annotated[float, BeforeValidator(ReadQuantity("length"))]
Gap = Annotated[float, BeforeValidator(ReadQuantity("length")), Ge(0)]
Travel = Annotated[float, BeforeValidator(ReadQuantity("length")), Usual(1e-7, 0.05)]
Opening = Annotated[Travel, AfterValidator(_open)]
Area = Annotated[float, BeforeValidator(ReadQuantity("area")), Gt(0)]
SignedArea = Annotated[float, BeforeValidator(ReadQuantity("area"))]
Volume = Annotated[float, BeforeValidator(ReadQuantity("volume")), Gt(0)]
MolarMass = Annotated[float, BeforeValidator(ReadQuantity("molar mass")), Gt(0)]
Temperature = Annotated[float, BeforeValidator(read_temperature), Gt(0)]
Source = Annotated[str, AfterValidator(_cited)]
Time = Annotated[float, BeforeValidator(ReadQuantity("time")), Gt(0)]
Delay = Annotated[float, BeforeValidator(ReadQuantity("time")), Ge(0)]
Mass = Annotated[float, BeforeValidator(ReadQuantity("mass")), Gt(0)]
Speed = Annotated[float, BeforeValidator(ReadQuantity("velocity")), Gt(0)]
Approach = Annotated[float, BeforeValidator(ReadQuantity("velocity")), AfterValidator(_moving)]
Density = Annotated[float, BeforeValidator(ReadQuantity("density")), Gt(0)]
Modulus = Annotated[float, BeforeValidator(ReadQuantity("modulus")), Gt(0)]
Stress = Annotated[float, BeforeValidator(ReadQuantity("strength")), Gt(0)]
Pressure = Annotated[float, BeforeValidator(ReadQuantity("pressure")), Gt(0)]
SignedPressure = Annotated[float, BeforeValidator(ReadQuantity("pressure"))]
Force = Annotated[float, BeforeValidator(ReadQuantity("force"))]
Acceleration = Annotated[float, BeforeValidator(ReadQuantity("acceleration"))]
Stiffness = Annotated[float, BeforeValidator(ReadQuantity("stiffness")), Gt(0)]
Frequency = Annotated[float, BeforeValidator(ReadQuantity("frequency")), Gt(0)]
Bedding = Annotated[float, BeforeValidator(ReadQuantity("bedding")), Ge(0)]
AreaDamping = Annotated[float, BeforeValidator(ReadQuantity("area damping")), Ge(0)]
Tilt = Annotated[float, BeforeValidator(ReadQuantity("tilt"))]
Angle = Annotated[float, BeforeValidator(ReadQuantity("angle"))]
HertzStiffness = Annotated[float, BeforeValidator(ReadQuantity("Hertz stiffness")), Gt(0)]
Slowness = Annotated[float, BeforeValidator(ReadQuantity("slowness")), Ge(0)]
Viscosity = Annotated[float, BeforeValidator(ReadQuantity("viscosity")), Gt(0)]
Rate = Annotated[float, BeforeValidator(ReadQuantity("rate")), Ge(0)]
Rpm = Annotated[float, BeforeValidator(read_rpm), Gt(0), Usual(100, 1e5)]

DampingRatio = Annotated[float, BeforeValidator(read_number), Ge(0), Lt(1), Usual(0, 0.2)]
LossFactor = Annotated[float, BeforeValidator(read_number), Ge(0), Lt(1)]
Fraction = Annotated[float, BeforeValidator(read_number), Gt(0), Lt(1)]
Tolerance = Annotated[float, BeforeValidator(read_number), Ge(1e-6), Lt(1)]
PoissonRatio = Annotated[float, BeforeValidator(read_number), Gt(-1), Lt(0.5)]

ExistingFile = Annotated[Path, AfterValidator(_existing_file)]
