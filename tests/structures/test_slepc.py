"""PETSc and SLEPc on two ranks against the built-in reduction: poles, Green's functions, scenes; what failures say."""

import os
import signal
import subprocess
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import scipy.linalg

from seatfem.jobs.folders import PREFIX
from seatfem.machine.libraries import MPIEXEC, PYTHON, RANKS, SECONDS, petsc_setting
from seatfem.structures.cache import key_of
from seatfem.structures.elements.axisymmetric import assemble_axisymmetric
from seatfem.structures.mesh.plane_meshes import make_meridian
from seatfem.structures.mesh.spec import MeshSpec
from seatfem.structures.model import Material, ModelError
from seatfem.structures.reduction import slepc
from seatfem.structures.reduction.factorization import FactorizationError
from seatfem.structures.reduction.greens import greens_function
from seatfem.structures.reduction.modes import DENSE
from seatfem.structures.reduction.slepc import RanksError, on_ranks
from seatfem.structures.shapes import AnnularSeat
from tests.gallery import LIP, load_text, mass
from tests.rod_model import rod_model

STEEL = Material(200e9, 0.3, 7850.0)
BAND, DURATION = 1e6, 5e-6
GAP = petsc_setting().gap()[0]
real = pytest.mark.skipif(bool(GAP), reason=GAP)


@pytest.fixture(autouse=True)
def two_ranks(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv(RANKS, "2")
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))


@pytest.fixture(scope="module")
def seat():
    """A body of revolution, clamped underneath, struck on its lip."""
    shape = AnnularSeat(bore_radius=2e-3, lip_width=1e-3, outer_radius=5e-3, thickness=3e-3)
    mesh = make_meridian(shape, MeshSpec(size=0.5e-3, contact_size=0.3e-3))
    return assemble_axisymmetric(mesh, STEEL)


def rod():
    return rod_model(young=200e9, density=7850.0, area=1e-4, length=30e-3, elements=30)


def both(model, method, tolerance, band=BAND):
    aims = {"bandwidth": band, "duration": DURATION, "tolerance": tolerance, "method": method}
    found = [greens_function(model, **aims, backend=backend) for backend in ("auto", "slepc")]
    assert [g.provenance["backend"] for g in found] == ["built-in", "slepc"]
    assert found[0].error_estimate.reduction == pytest.approx(found[1].error_estimate.reduction, rel=1e-5, abs=1e-12)
    return found


def apart(one, other, band=BAND):
    t = np.linspace(0.0, DURATION, 201)
    a, b = (g.filtered_matrix(t, 1 / band) for g in (one, other))
    return np.abs(a - b).max() / np.abs(a).max()


@real
def test_krylov_is_that_of_the_built_in_backend(seat, tmp_path):
    # of many more vectors round-off decides what the last ones hold: PARDISO and SuperLU differ there as well
    one, other = both(seat, "krylov", 1e-2)
    assert one.provenance["vectors"] == other.provenance["vectors"]
    assert other.provenance["factorization"] == "mumps"
    band = one.omega < 2 * np.pi * BAND
    assert band.sum() >= 6
    assert other.omega[: band.sum()] == pytest.approx(one.omega[band], rel=1e-8)
    assert np.abs(other.shapes[: band.sum()]) == pytest.approx(np.abs(one.shapes[band]), rel=1e-7)
    assert apart(one, other) < 1e-8
    stiffer = greens_function(
        replace(seat, K=1.03 * seat.K), bandwidth=BAND, duration=DURATION, tolerance=1e-2, method="krylov"
    )
    assert apart(one, stiffer) > 1e-3  # three per cent are seen
    assert list(tmp_path.glob(f"{PREFIX}*")) == []


@real
def test_modes_are_those_of_the_built_in_backend_none_missing(seat):
    assert seat.size > DENSE  # up to there the built-in backend takes LAPACK
    one, other = both(seat, "modes", 0.3, 3e5)
    assert other.omega == pytest.approx(one.omega, rel=1e-8)
    assert apart(one, other, 3e5) < 1e-8


@real
def test_factorizations_solve_and_count():
    model = rod()
    values = scipy.linalg.eigh(model.K.toarray(), model.M.toarray(), eigvals_only=True)
    between = (values[4] + values[5]) / 2
    with on_ranks(model) as ranks:
        load = np.eye(model.size)[:, :3]
        found = ranks.factorize(1e10).solve(load)
        assert (model.K + 1e10 * model.M) @ found == pytest.approx(load, abs=1e-9)
        assert ranks.factorize(-between, definite=False).negative_pivots == 5  # Sylvester
        with pytest.raises(FactorizationError, match=r"positive.*5 negative"):
            ranks.factorize(-between)


@real
def test_ranks_that_are_killed_leave_a_message_and_nothing_else(tmp_path):
    with on_ranks(rod()) as ranks:
        pids = ranks_of(ranks.folder)
        os.kill(pids[0], signal.SIGKILL)
        with pytest.raises(RanksError, match=r"137.*signal 9"):
            ranks.factorize(1e10)
    assert not any(alive(pid) for pid in pids)
    assert list(tmp_path.glob(f"{PREFIX}*")) == []


@real
def test_a_step_that_takes_too_long_is_ended(monkeypatch, tmp_path):
    monkeypatch.setenv(SECONDS, "1")
    monkeypatch.setattr(slepc, "PATIENCE", 0.1)
    with on_ranks(rod()) as ranks:
        pids = ranks_of(ranks.folder)
        for pid in pids:
            os.kill(pid, signal.SIGSTOP)
        with pytest.raises(RanksError, match=r"1 s; .*SEATFEM_MPI_SECONDS"):
            ranks.factorize(1e10)
    deadline = time.monotonic() + 20
    while any(alive(pid) for pid in pids) and time.monotonic() < deadline:
        time.sleep(0.02)
    assert not any(alive(pid) for pid in pids)
    assert list(tmp_path.glob(f"{PREFIX}*")) == []


@real
def test_what_fails_on_the_ranks_is_told_in_its_last_lines():
    with (
        on_ranks(rod()) as ranks,
        pytest.raises(RanksError, match=r"exit code 1; .*`seatfem doctor`\n(.*\n)*.*do_nonsense"),
    ):
        ranks.ask("nonsense")


def test_what_is_missing_is_named_with_its_remedy(monkeypatch, tmp_path):
    aims = {"bandwidth": BAND, "duration": DURATION, "tolerance": 0.1, "backend": "slepc"}
    monkeypatch.setenv(PYTHON, str(tmp_path / "python"))
    monkeypatch.setenv(MPIEXEC, "true")
    with pytest.raises(RanksError, match=r"apt-get install .* python3-petsc4py python3-slepc4py openmpi-bin"):
        greens_function(rod(), **aims, method="krylov")
    monkeypatch.setenv(MPIEXEC, "no-such-mpiexec -v")
    with pytest.raises(RanksError, match=r"no-such-mpiexec .*SEATFEM_MPIEXEC"):
        greens_function(rod(), **aims, method="krylov")
    monkeypatch.setenv(RANKS, "two")
    with pytest.raises(RanksError, match="SEATFEM_MPI_RANKS = 'two'"):
        greens_function(rod(), **aims, method="krylov")
    with pytest.raises(ModelError, match=r"backend='slepc'.*transient"):
        greens_function(rod(), **aims, method="transient")


def test_scenes_ask_for_it_and_share_what_is_stored(tmp_path):
    reed = "[reed]\n" + mass(1, "-1 m/s") + '[run]\nduration = "30 us"\n'
    seats = [
        load_text(tmp_path, "[seat]\n", LIP, asked, reed).seat for asked in ("", 'greens = { backend = "slepc" }\n')
    ]
    one, other = (seat.stated() for seat in seats)
    assert (one.distributed, other.distributed) == (False, True)
    assert key_of(seats[0], one) == key_of(seats[1], other)


def ranks_of(folder: Path) -> list[int]:
    found = subprocess.run(["pgrep", "-f", f"_slepc_ranks.py {folder}"], capture_output=True, text=True, check=True)
    commands = {int(pid): Path(f"/proc/{pid}/cmdline").read_bytes() for pid in found.stdout.split()}
    return [pid for pid, command in commands.items() if not command.split(b"\0")[0].endswith(b"mpiexec")]


def alive(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().split(") ")[1][0] not in "ZX"
    except OSError:
        return False
