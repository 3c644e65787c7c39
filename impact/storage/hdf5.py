"""Green's functions, results and stopped marches on disk (HDF5), with provenance and a schema number."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from uuid import uuid4

import h5py
import numpy as np
from numpy.typing import NDArray

from impact.after.result import EnergyLedger, ImpactResult, RunRows
from impact.exact import closed_form, half_space
from impact.files import safe_files
from impact.greens import base, modal
from impact.greens.poles import PoleGreens
from impact.greens.sampled import SampledGreens
from impact.march.prepared import MOST_STEPS
from impact.march.problem import ContactError
from impact.march.rows import Replayed
from impact.march.stepper import ContactStepper
from impact.notices import Advice, SeatfemError
from impact.quantities import brief_value

SCHEMA = 2
"""1: histories at equal steps; 2: a result may have steps of different lengths, whose ``ends`` it has."""
BLOCK = 1 << 20  # bytes by which a file grows in memory
_CLOSED: dict[str, Callable[..., base.GreensFunction]] = {
    "delay_rod": closed_form.DelayRod,
    "damped_fixed_rod": closed_form.DampedFixedRod,
    "damped_free_rod": closed_form.DampedFreeRod,
    "two_ended_rod": closed_form.TwoEndedRod,
    "power_law": closed_form.PowerGreens,
    "half_space_patch": half_space.half_space_patch,
}
_KINDS = ("modal", "sampled", "poles", *_CLOSED, "sum", "scaled")
_POLES = ("rates", "real_shapes", "signs", "rigid", "compliance")
_AT_CONTACTS = ("striker_displacement", "target_displacement")
"""Histories that are left out where a run makes them on demand (`impact.march.rows.Replayed`)."""
_SERIES = ("force", "gap", *_AT_CONTACTS)
_LEDGER = ("input", "striker", "target", "contact", "dissipated", "contact_loss")
_BROKEN = (OSError, LookupError, ValueError, TypeError, AttributeError, ArithmeticError, MemoryError, RuntimeError)
"""What reading damaged bytes raises; RuntimeError: HDF5's own."""
_NUMBERS = ("dt", "striker_mass", "target_mass", "striker_velocity", "target_velocity")
FILE_LIMIT = 8192 * safe_files.MB
_DEFLATE = 1032  # largest compression, bytes per byte
USER_BLOCK = 512  # bytes before the data of an HDF5 file, which the format leaves to the application
_MAGIC = b"impact file, sha256 of all after byte 512: "


class StorageError(SeatfemError, ValueError):
    """A file that cannot be read or written; the message names file, key and remedy."""


class OtherKeyError(StorageError):
    """A sound file, of something else than what is asked for."""


class _Damage(ValueError):
    """A fault of a key, for `opened` to put file and remedy around."""


def save_greens(greens: base.GreensFunction, path: str | os.PathLike[str], *, key: str = "") -> None:
    """Write a Green's function with its provenance; the file is whole or absent.

    ``key``: identifies what it was computed from; `load_greens` may ask for it.
    """
    if not isinstance(greens, base.GreensFunction):
        raise StorageError(f"{brief_value(greens)} is no Green's function; give first that, then the path")
    with written(path, "greens") as file:
        file.attrs["key"] = key
        _write_greens(file, greens)


def load_greens(path: str | os.PathLike[str], *, key: str = "") -> base.GreensFunction:
    """Read a Green's function written by `save_greens`; with a ``key``, only that very function, its seal intact.

    Raises:
        StorageError: no such file, truncated or damaged, not a Green's function, or of a newer schema; with a ``key``
            also one without a seal, or `OtherKeyError` one that was stored under another.
    """
    with opened(path, "greens", sealed=bool(key)) as file:
        if key and (stored := str(file.attrs.get("key", ""))) != key:
            raise OtherKeyError(
                f"{path}: belongs to the key {stored or 'of nothing'!r}, not to {key!r}; compute it again"
            )
        return _read_greens(file, path)


def _read_greens(file: Any, path: str | os.PathLike[str]) -> base.GreensFunction:
    """Return the function of a file, or of a group in it: a part of a sum or of a multiple."""
    kind = str(file.attrs["kind"])
    if kind in ("sum", "scaled"):
        parts = tuple(_read_greens(file[f"parts/{n}"], path) for n in range(len(file["parts"])))
        return base.SumGreens(parts) if kind == "sum" else base.ScaledGreens(parts[0], float(file.attrs["factor"]))
    origin = json.loads(str(file.attrs["provenance"]))
    if not isinstance(origin, dict):
        raise _Damage("provenance is no table")
    error = base.ErrorEstimate(*(_known(file.attrs[f"error_{n}"]) for n in ("reduction", "mesh")))
    valid = float(file.attrs.get("valid_for", np.inf))  # files before this attribute state no limit
    if kind == "modal":
        residual = modal.Residual(*(finite_array(file, f"residual/{n}") for n in ("shapes", "rates", "compliance")))
        omega, zeta, shapes = (finite_array(file, n) for n in ("omega", "zeta", "shapes"))
        return modal.ModalGreens(omega, zeta, shapes, residual, _names(file), error, origin, valid)
    if kind == "sampled":
        values, static = finite_array(file, "values"), finite_array(file, "static") if "static" in file else np.zeros(0)
        dt, tail = float(file.attrs["dt"]), str(file.attrs["tail"])
        return SampledGreens(values, dt, tail, _names(file), static, error, origin)  # type: ignore[arg-type]
    if kind == "poles":
        poles, pairs = _complex_array(file, "poles"), _complex_array(file, "shapes")
        rates, real, signs, rigid, spring = (finite_array(file, name) for name in _POLES)
        return PoleGreens(poles, pairs, rates, real, signs, rigid, spring, _names(file), error, origin, valid)
    if kind in _CLOSED:
        return _CLOSED[kind](**{k: float(v) for k, v in origin.items() if k != "kind"})
    raise StorageError(f"{path}: unknown kind of Green's function {kind!r}; known: {', '.join(_KINDS)}")


def save_results(
    path: str | os.PathLike[str], results: Mapping[str, ImpactResult], about: Mapping[str, object]
) -> None:
    """Write results by name (one HDF5 group each) and what they are about (JSON); the file is whole or absent."""
    uniform = all(result.rows.is_uniform for result in results.values())
    with written(path, "result", schema=1 if uniform else SCHEMA) as file:
        file.attrs["about"] = json.dumps(dict(about), default=str)
        stored: dict[int, tuple[Any, Any]] = {}  # what results share, as their time, is stored once and linked
        axes: dict[int, Any] = {}
        for name, result in results.items():
            group, rows = file.create_group(name), result.rows
            known = {key: getattr(rows, key) for key in (*_SERIES, "film")}
            histories = {key: None if isinstance(values, Replayed) else values for key, values in known.items()}
            histories |= {f"energy/{key}": getattr(rows.energy, key) for key in (*_LEDGER, "film_loss")}
            histories |= {} if np.any(rows.film) else {"film": None, "energy/film_loss": None}
            histories["time"] = axes.setdefault(id(rows.ends), rows.time)
            histories["ends"] = None if uniform else rows.ends
            for key, history in histories.items():
                if id(history) in stored:
                    group[key] = stored[id(history)][1]
                elif history is not None:
                    dataset = group.create_dataset(key, data=history, compression="gzip", shuffle=True)
                    stored[id(history)] = history, dataset
            for key in _NUMBERS:
                group.attrs[key] = getattr(result, key)
            group.attrs["engine"] = result.engine
            group.attrs["by_work"] = json.dumps(rows.energy.by_work)
            group.attrs["advice"] = json.dumps([vars(a) for a in result.advice])


def load_results(path: str | os.PathLike[str]) -> dict[str, ImpactResult]:
    """Read what `save_results` wrote; raises `StorageError` as `load_greens` does."""
    out = {}
    with opened(path, "result") as file:
        for name, group in file.items():
            filmed = "film" in group
            ledger = {key: finite_array(group, f"energy/{key}") for key in (*_LEDGER, *["film_loss"] * filmed)}
            of_many = np.ndim(group.get("force", 0.0)) == 2
            needed = [key for key in _SERIES if key in group or key not in _AT_CONTACTS or not of_many]
            values: dict[str, Any] = {key: finite_array(group, key) for key in (*needed, *["film"] * filmed)}
            ends = _read_ends(name, group)
            _check_histories(name, ends, values, ledger)
            missing: dict[str, Any] = dict.fromkeys(_AT_CONTACTS)
            numbers = {key: float(group.attrs[key]) for key in _NUMBERS}
            energy = EnergyLedger(**ledger, by_work=tuple(json.loads(str(group.attrs["by_work"]))))
            out[name] = ImpactResult(
                rows=RunRows(numbers.pop("dt"), ends, **missing | values, energy=energy),
                **numbers,
                engine=str(group.attrs["engine"]),
                advice=tuple(Advice(**a) for a in json.loads(str(group.attrs["advice"]))),
            )
    return out


def _read_ends(name: str, group: Any) -> NDArray[np.int64]:
    """Return the (N + 1,) ends of the steps of a result, in fine ones."""
    if "ends" not in group:
        return np.arange(finite_array(group, "time").size)
    ends = finite_array(group, "ends").astype(np.int64)
    if ends.ndim != 1 or len(ends) == 0 or ends[0] != 0 or np.any(np.diff(ends) < 1) or ends[-1] > MOST_STEPS:
        raise _Damage(f"the ends of the steps of {name} do not rise from 0 to at most {MOST_STEPS:g}")
    return ends


def _check_histories(
    name: str, ends: NDArray[np.int64], values: Mapping[str, base.Array], ledger: Mapping[str, base.Array]
) -> None:
    """Raise `_Damage` unless energies are (N + 1,) as the ends of steps, the others alike or (N + 1, p) all, p
    contacts."""
    contacts = {key: array.shape for key, array in values.items()}
    lengths = {shape[:1] for shape in contacts.values()} | {array.shape for array in ledger.values()}
    if lengths != {ends.shape}:
        raise _Damage(f"the histories of {name} differ in length")
    if len(set(contacts.values())) > 1 or (contacts["force"][1:] and len(contacts["force"]) != 2):
        raise _Damage(f"the histories of {name} differ in their number of contacts")


def _write_greens(file: Any, greens: base.GreensFunction) -> None:
    """Write into a file, or a group of it, what the function says that it needs to be made again."""
    stored = greens.stored()
    if stored.kind not in _KINDS:
        raise StorageError(
            f"a Green's function of type {type(greens).__name__!r} has no file form; sample it, and save the samples"
        )
    file.attrs["kind"] = stored.kind
    for name, number in stored.numbers.items():
        file.attrs[name] = number
    for number, part in enumerate(stored.parts):
        _write_greens(file.create_group(f"parts/{number}"), part)
    if stored.parts:
        return
    file.attrs["provenance"] = json.dumps(dict(greens.provenance), default=str)
    file.attrs["valid_for"] = greens.valid_for
    for name in ("reduction", "mesh"):
        value = getattr(greens.error_estimate, name)
        file.attrs[f"error_{name}"] = np.nan if value is None else value
    if stored.arrays:
        file.attrs["ports"] = json.dumps(greens.ports)
    for name, values in stored.arrays.items():
        if np.iscomplexobj(values):
            file[f"{name}/real"], file[f"{name}/imag"] = values.real, values.imag
        else:
            file[name] = values


def seal_of(image: bytes) -> bytes:
    """Return the user block that precedes the bytes of an HDF5 file: a checksum, as HDF5 may crash on damaged bytes."""
    return (_MAGIC + hashlib.sha256(image).hexdigest().encode() + b"\n").ljust(USER_BLOCK, b"\0")


def has_seal(path: Path) -> bool:
    """Return whether a file begins with a seal."""
    with path.open("rb") as file:
        return file.read(USER_BLOCK).startswith(_MAGIC)


def seal_holds(path: Path) -> bool:
    """Return whether a file with a seal is as it was written."""
    with path.open("rb") as file:
        head = file.read(USER_BLOCK)
        digest = hashlib.file_digest(file, "sha256").hexdigest().encode()
    return head.startswith(_MAGIC) and head[len(_MAGIC) :].split(b"\n")[0] == digest


@contextmanager
def written(path: str | os.PathLike[str], content: str, *, schema: int = 1) -> Iterator[Any]:
    """Yield an HDF5 file to fill, stamped with its ``content`` and schema, sealed at the end; whole or absent."""
    # HDF5 makes the file in memory: on a full disk it could not close it, and would crash
    try:
        with h5py.File(uuid4().hex, "w", driver="core", backing_store=False, block_size=BLOCK) as file:
            file.attrs["content"] = content
            file.attrs["schema"] = schema
            yield file
            file.flush()
            image = file.id.get_file_image()
    except (MemoryError, OSError, RuntimeError) as problem:  # HDF5's words where memory runs out
        raise MemoryError(
            f"{path}: no memory to put the file together ({problem}); free some, or shorten the run"
        ) from problem
    safe_files.write_whole(path, seal_of(image), image)


@contextmanager
def opened(path: str | os.PathLike[str], content: str, *, sealed: bool = False) -> Iterator[Any]:
    """Yield the open file, checked; anything that goes wrong while reading becomes a `StorageError`.

    ``sealed``: refuse a file without a seal, too.
    """
    name = Path(path)
    if not name.exists():
        raise StorageError(f"{name}: no such file; check the path")
    safe_files.check_file(name, FILE_LIMIT, StorageError)
    if (has_seal(name) or sealed) and not seal_holds(name):
        what = "truncated or damaged (its checksum differs)" if has_seal(name) else "has no seal of its content"
        raise StorageError(f"{name}: {what}; compute it again")
    try:
        with h5py.File(name, "r") as file:
            stored, schema = str(file.attrs.get("content", "")), int(file.attrs.get("schema", -1))
            if stored != content or schema < 0:
                raise StorageError(f"{name}: holds {stored or 'something else'!r}, a {content!r} file is needed")
            if schema > SCHEMA:
                raise StorageError(
                    f"{name}: schema {schema} is newer than this version reads (up to {SCHEMA}); update the package"
                )
            yield file
    except StorageError:
        raise
    except (_Damage, base.GreensFunctionError) as problem:
        raise StorageError(f"{name}: damaged: {problem}; compute it again") from problem
    except _BROKEN as problem:
        raise StorageError(f"{name}: truncated or damaged ({problem}); compute it again") from problem


def finite_array(group: Any, key: str) -> base.Array:
    """Return a dataset of finite numbers; one that claims more of them than the file can hold is refused as damaged
    before memory is taken."""
    if key not in group:
        raise _Damage(f"{key} is missing")
    dataset = group[key]
    if dataset.nbytes > _DEFLATE * dataset.id.get_storage_size():
        raise _Damage(f"{key} claims {dataset.nbytes / 1e9:.3g} GB, more than the file can hold")
    if dataset.dtype.kind not in "fiu":
        raise _Damage(f"{key} holds {dataset.dtype}, no real numbers")
    values = np.asarray(dataset[...], dtype=float)
    if bad := int(np.sum(~np.isfinite(values))):
        raise _Damage(f"{key} has {bad} values that are not finite")
    return values


def _complex_array(group: Any, key: str) -> NDArray[np.complex128]:
    return np.asarray(finite_array(group, f"{key}/real") + 1j * finite_array(group, f"{key}/imag"), dtype=complex)


def _names(file: Any) -> tuple[str, ...]:
    return tuple(json.loads(str(file.attrs["ports"])))


def _known(value: float) -> float | None:
    return None if np.isnan(value) else float(value)


SAME_PROBLEM = 1e-9  # largest relative difference at which two discretised problems count as the same
_PARTS = ("problem", "state")


def save_checkpoint(stepper: ContactStepper, path: str | os.PathLike[str]) -> None:
    """Write the state of a march and what identifies its problem; the file is whole or absent."""
    with written(path, "checkpoint") as file:
        for name, values in _identity(stepper).items():
            file[f"problem/{name}"] = values
        for name, values in stepper.checkpoint().items():
            file[f"state/{name}"] = values


def restore_checkpoint(stepper: ContactStepper, path: str | os.PathLike[str]) -> None:
    """Continue a fresh stepper of the same problem, prepared in the same way, from where the file's march stood.

    Raises:
        StorageError: no such file, truncated or damaged, or of another problem (naming what differs).
        ContactError: the stepper has already marched.
    """
    with opened(path, "checkpoint") as file:
        theirs, state = ({name: finite_array(file[part], name) for name in file[part]} for part in _PARTS)
    mine = _identity(stepper)
    alike = [name for name in mine.keys() & theirs.keys() if mine[name].shape == theirs[name].shape]
    same = [name for name in alike if np.allclose(mine[name], theirs[name], rtol=SAME_PROBLEM, atol=SAME_PROBLEM)]
    differing = [name for name in mine if name not in same]
    if differing:
        raise StorageError(
            f"{path}: checkpoint of another problem: {', '.join(differing)} differ by more than {SAME_PROBLEM:g}; "
            "prepare the problem exactly as it was when the checkpoint was written"
        )
    try:
        stepper.restore(state)
    except ContactError as problem:
        if stepper.done:
            raise
        raise StorageError(f"{path}: {problem}") from problem


def _identity(stepper: ContactStepper) -> dict[str, base.Array]:
    """Return a few numbers per ingredient; each changes when any element of the ingredient does."""
    s = stepper.prepared
    laws = [np.array([c.law.code, *c.law.parameters, c.side]) for c in s.problem.contacts]
    filmed = any(c.film is not None for c in s.problem.contacts)
    films = [np.log(np.clip(c.film_parameters, 1e-300, 1e300)) for c in s.problem.contacts if filmed]
    return {
        "step dt": np.array([s.dt]),
        "duration": np.array([float(s.steps)]),
        "contacts": np.array([float(len(laws))]),
        "laws": np.concatenate([*laws, s.rules, np.ravel(films)]),
        "history engine": np.array([float(s.plan.block), *map(float, s.plan.by_poles)]),
        "preload": _digest(s.rest),
        "free motion": _digest(s.free),
        "poles": np.concatenate([_digest(row) for row in (*s.poles.steps, s.poles.psi)]),
        "step weights": np.concatenate([_digest(s.own), _digest(s.weights)]),
        "load shapes": np.concatenate([_digest(load.shape) for load in s.problem.striker.loads] or [np.zeros(1)]),
    }


def _digest(values: base.Array) -> base.Array:
    """Return the length of the array, its largest absolute element, and two sums over that element."""
    flat = values.ravel()
    size = float(np.max(np.abs(flat), initial=0.0))
    mixed = flat @ np.cos(np.arange(len(flat))) if len(flat) else 0.0
    return np.array([len(flat), size, size and flat.sum() / size, size and mixed / size])
