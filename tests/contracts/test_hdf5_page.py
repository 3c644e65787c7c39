"""docs/hdf5.md and what is written as HDF5: each has all that the other has; files of older schemas stay readable."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest

import impact
from impact.storage.hdf5 import save_checkpoint
from seatfem.pictures.frames import Frames
from seatfem.pictures.moving import load_moving, save_moving
from seatfem.study.runs.body_stress import History, Spot
from seatfem.study.runs.stress_spots import Spots, write_spots
from tests.steps import GreensFunction, ModalGreens, Residual

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "hdf5.md").read_text(encoding="utf-8")
OLD = ROOT / "tests" / "impact" / "schema_1"
REST = Residual(np.array([[0.5]]), np.array([2e4]), np.array([[1e-9]]))
SEAT = ModalGreens(np.array([2e4]), np.array([0.1]), np.array([[3.0]]), REST, valid_for=1.0)
FILM = impact.SqueezeFilm(1e-12, 1e-6)
TWO = np.array([[[0.0, 0.0, 1.0]] * 3, [[0.0, 1.0, 0.0]] * 3])
BODY = Frames("", np.eye(3), np.array([[0, 1, 2]]), TWO, ("1", "2"))


def problem(film: impact.SqueezeFilm | None = None) -> impact.ContactProblem:
    """Return a mass on an oscillator."""
    touch = impact.Contact(impact.Body(SEAT), law=impact.LinearSpring(1e6), gap=1e-6, film=film)
    return impact.ContactProblem(impact.rigid_mass(mass=1e-3, velocity=-1.0), contacts=[touch])


def results(folder: Path) -> None:
    """Write one run without a film and one with it."""
    runs = {
        name: impact.solve(problem(film), dt=1e-6, duration=2e-5) for name, film in (("wave", None), ("spring", FILM))
    }
    impact.save_results(folder / "result.h5", runs, {"title": ""})
    wave = runs["wave"]
    in_long_steps = replace(wave, rows=replace(wave.rows, ends=3 * wave.rows.ends))
    impact.save_results(folder / "long.h5", {"wave": in_long_steps}, {"title": ""})


def greens(folder: Path) -> None:
    """Write one function of every kind that needs datasets."""
    t = 1e-5 * np.arange(200)
    sampled = impact.SampledGreens(SEAT.impulse_response(t)[None, None], 1e-5, tail="zero", static=np.array([[1e-6]]))
    other = replace(SEAT, residual=Residual.none())
    every: tuple[GreensFunction, ...] = (
        SEAT, impact.PoleGreens.from_modal(SEAT), sampled, impact.SumGreens((SEAT, other)),
        impact.ScaledGreens(SEAT, 2.0), impact.fixed_rod(young=2e11, density=7850.0, length=0.1, area=1e-4),
    )  # fmt: skip
    for number, one in enumerate(every):
        impact.save_greens(one, folder / f"{number}.h5")


def bodies(folder: Path) -> None:
    """Write modes, and a run with values."""
    save_moving(replace(BODY, frequency=np.array([1.0, 2.0]), modal_mass=np.ones(2)), folder / "modes.h5")
    save_moving(replace(BODY, time=np.array([0.0, 1.0]), values=np.eye(2, 3)), folder / "wave.h5")


def stresses(folder: Path) -> None:
    """Write the stresses at one place of a beam."""
    spot = Spot("reed", "", (0.01,), np.inf, 1e8, 1e-6, "bending", 1e8)
    write_spots(Spots((spot,), (History(spot, ("bending",), np.ones((1, 3))),), np.arange(3.0)), folder)


def checkpoints(folder: Path) -> None:
    """Write a checkpoint in the midst of a march."""
    stepper = impact.ContactStepper(impact.prepare(problem(), 1e-6, 2e-5))
    stepper.advance(5)
    save_checkpoint(stepper, folder / "march.h5")


def written_names(folder: Path, content: str) -> set[str]:
    """Return paths of datasets, and of attributes after an @; runs, numbers and free names in the page's words."""
    names: set[str] = set()

    def look(name: str, item: h5py.Group | h5py.Dataset) -> None:
        at = re.sub(r"^parts/[0-9]+", "parts/N", name)
        at = re.sub(r"^(wave|spring)(?=/|$)", "RUN", at) if content == "result" else at
        at = re.sub(r"^[0-9]{2}(?=/|$)", "NN", at)
        at = re.sub(r"^(problem|state)/.*", r"\1/QUANTITY", at) if content == "checkpoint" else at
        names.update(f"{at}@{key}" for key in item.attrs)
        if isinstance(item, h5py.Dataset):
            names.add(at)

    for path in folder.glob("*.h5"):
        with h5py.File(path, "r") as file:
            assert file.attrs["content"] == content
            look("", file)
            file.visititems(look)
    return names


@pytest.mark.parametrize(
    ("content", "write"),
    [
        ("result", results), ("greens", greens), ("moving body", bodies), ("stress", stresses),
        ("checkpoint", checkpoints),
    ],
)  # fmt: skip
def test_the_page_names_all_that_is_written_and_no_more(
    content: str, write: Callable[[Path], None], tmp_path: Path
) -> None:
    write(tmp_path)
    section = PAGE.split(f"## `{content}`")[1].split("\n## ")[0]
    rows = [line.split("|")[1] for line in section.splitlines() if line.startswith("| `")]
    listed = [name for row in rows for name in re.findall(r"`([^`]+)`", row)]
    assert len(listed) == len(set(listed))
    assert set(listed) == written_names(tmp_path, content)


def test_files_of_schema_1_are_read() -> None:
    """Files of schema 1 are read; their modes have no frequencies, which the schema did not hold at first."""
    seat = impact.load_greens(OLD / "greens.h5")
    assert isinstance(seat, ModalGreens)
    np.testing.assert_array_equal(seat.omega, SEAT.omega)
    np.testing.assert_array_equal(seat.residual.rates, REST.rates)
    runs = impact.load_results(OLD / "result.h5")
    for name, film in (("wave", None), ("spring", FILM)):
        again = impact.solve(problem(film), dt=1e-6, duration=2e-5)
        np.testing.assert_allclose(runs[name].force, again.force, atol=1e-6 * again.force.max())
        assert np.any(runs[name].film) == (film is not None)
    body = load_moving(OLD / "modes.h5")
    assert body.frequency is None
    np.testing.assert_array_equal(body.displacement, TWO)
