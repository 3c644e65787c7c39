"""A new reduction is one file: no other knows this one, and Python and scenes ask for it by its name."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from scipy import linalg

import seatfem
from impact.notices import Progress, silent
from seatfem.structures.method import Aims
from seatfem.structures.model import Damping, ModelError, SecondOrderModel
from seatfem.structures.reduction import greens as registry
from seatfem.structures.reduction.reducer import Cost, Reducer, Reduction, truncate
from seatfem.study.scene.problems import SceneError
from tests.gallery import load_text
from tests.rod_model import rod_model
from tests.steps import ErrorEstimate, run_scene

SCENE = """
seat = { kind = "annular", model = "axisymmetric", bore_radius = "4 mm", lip_width = "2 mm", lip_edge_radius = "0 mm", \
    damping_ratio = 0.1, mesh = { size = "3 mm", contact_size = "1.5 mm" }, \
    greens = { bandwidth = "100 kHz", tolerance = "3 %", method = "toy" }, \
    material = { young = "200 GPa", density = "7850 kg/m^3" } }
reed = { kind = "rigid_mass", mass = "1 g", velocity = "-1 m/s" }
run = { duration = "30 us" }
accuracy = { target = "50 %" }
"""


@pytest.fixture
def toy() -> Iterator[type[Reducer]]:
    """Register the class by defining it; without its name it is none any more."""

    class Toy(Reducer):
        """Modes of a small model up to five times the band, by LAPACK."""

        name = "toy"
        any_time = True

        def refusal(self, model: SecondOrderModel, damping: Damping, aims: Aims) -> str:
            few = "" if model.size <= 2000 else f"toy: {model.size} unknowns are too many; use method='krylov'"
            return damping.refusal or few

        def cost(self, model: SecondOrderModel, aims: Aims) -> Cost:
            return Cost(1e6, "a toy")

        def reduce(
            self, model: SecondOrderModel, damping: Damping, aims: Aims, progress: Progress = silent
        ) -> Reduction:
            values, shapes = linalg.eigh(model.K.toarray(), model.M.toarray())
            omega = np.sqrt(values)
            ratios, amplitudes = damping.ratios(omega), shapes.T @ model.port_matrix
            nothing = np.zeros((len(model.ports),) * 2)
            greens = truncate(omega, ratios, amplitudes, 5 * aims.band, nothing, model, damping)
            return Reduction(greens.with_error(ErrorEstimate(reduction=aims.tolerance / 3), {"toys": 1}))

    yield Toy
    del Toy.name


@pytest.mark.usefixtures("toy")
def test_a_toy_is_asked_for_by_name() -> None:
    model = rod_model(young=200e9, density=7850.0, area=1e-4, length=30e-3, elements=60)
    aims = {"bandwidth": 1e5, "duration": 5e-5, "tolerance": 1e-2}
    ours, theirs = (seatfem.greens_function(model, **aims, method=method) for method in ("toy", "modes"))
    assert ours.provenance["method"] == "toy"
    assert ours.provenance["toys"] == 1
    assert ours.valid_for == np.inf
    t = np.linspace(0.0, 5e-5, 101)
    one, other = (g.filtered(t, 1e-5) for g in (ours, theirs))
    assert np.abs(one - other).max() <= 1e-2 * np.abs(other).max()
    assert "toy" in seatfem.greens_function(model, **aims).provenance["reason"]  # auto asked it as well
    large = rod_model(young=200e9, density=7850.0, area=1e-4, length=30e-3, elements=1200)
    with pytest.raises(ModelError, match="2400 unknowns are too many"):
        seatfem.greens_function(large, **aims, method="toy")


@pytest.mark.slow
@pytest.mark.usefixtures("toy")
def test_a_scene_runs_with_a_toy(tmp_path: Path) -> None:
    summary = run_scene(load_text(tmp_path, SCENE), tmp_path / "out", pictures=False).summary
    assert summary["greens_error_reduction"] == pytest.approx(0.01)
    assert summary["peak_force_N"] > 0


def test_names_are_listed_where_none_is_right(tmp_path: Path) -> None:
    with pytest.raises(ModelError, match=r"'toy'.*auto, krylov, modes"):
        registry.named("toy")
    with pytest.raises(SceneError, match=r"seat\.greens\.method: 'toy'.*'auto', 'krylov', 'modes'"):
        load_text(tmp_path, SCENE)


def test_two_of_one_name_are_refused(toy: type[Reducer]) -> None:
    class Twin(toy):  # type: ignore[misc, valid-type]
        name = "toy"

    with pytest.raises(ModelError, match="two reductions are named 'toy'"):
        registry.reducers()
    del Twin.name
