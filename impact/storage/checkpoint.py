"""A march on disk (HDF5): stop here, go on later, bit for bit."""

from __future__ import annotations

import os

import numpy as np

from impact.greens.base import Array
from impact.march.problem import ContactError
from impact.march.stepper import ContactStepper
from impact.storage.hdf5 import StorageError, finite_array, opened, written

SAME = 1e-9  # relative difference up to which two discretised problems count as the same
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
    same = [name for name in alike if np.allclose(mine[name], theirs[name], rtol=SAME, atol=SAME)]
    differing = [name for name in mine if name not in same]
    if differing:
        raise StorageError(
            f"{path}: checkpoint of another problem: {', '.join(differing)} differ by more than {SAME:g}; "
            "prepare the problem exactly as it was when the checkpoint was written"
        )
    try:
        stepper.restore(state)
    except ContactError as problem:
        if stepper.done:
            raise
        raise StorageError(f"{path}: {problem}") from problem


def _identity(stepper: ContactStepper) -> dict[str, Array]:
    """Return a few numbers per ingredient; each changes when any element of the ingredient does."""
    s = stepper.prepared
    laws = [(c.law.code, *c.law.parameters, c.side) for c in s.problem.contacts]
    filmed = any(c.film is not None for c in s.problem.contacts)
    films = [np.log(np.clip(c.film_parameters, 1e-300, 1e300)) for c in s.problem.contacts if filmed]
    return {
        "step dt": np.array([s.dt]),
        "duration": np.array([float(s.steps)]),
        "contacts": np.array([float(len(laws))]),
        "laws": np.array([*np.ravel(laws), *s.rules, *np.ravel(films)], dtype=float),
        "history engine": np.array([float(s.plan.block), *map(float, s.plan.by_poles)]),
        "preload": _digest(s.rest),
        "free motion": _digest(s.free),
        "poles": np.concatenate([_digest(row) for row in (*s.poles.steps, s.poles.psi)]),
        "step weights": np.concatenate([_digest(s.own), _digest(s.weights)]),
        "load shapes": np.concatenate([_digest(load.shape) for load in s.problem.striker.loads] or [np.zeros(1)]),
    }


def _digest(values: Array) -> Array:
    """Return the size of the array, then two sums on the scale of its largest element (the third number)."""
    flat = values.ravel()
    size = float(np.max(np.abs(flat), initial=0.0))
    mixed = flat @ np.cos(np.arange(len(flat))) if len(flat) else 0.0
    return np.array([len(flat), size, size and flat.sum() / size, size and mixed / size])
