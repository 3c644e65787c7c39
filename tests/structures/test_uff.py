"""Universal files written from a system with a known answer, in several units, read back."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import pyuff

import impact
from impact.measured.frf import FrequencyResponse
from impact.measured.pole_fit import fit_poles
from seatfem.structures.formats.uff import UffError, read_modes_uff, write_modes_uff, write_receptance_uff
from seatfem.structures.formats.uff_responses import read_frf_uff, read_impulse_response_uff
from tests.uff_sets import function_set, mode_set, unit_set, write_sets

BODY = impact.ModalGreens(
    2 * np.pi * np.array([2e3, 5.1e3, 9.3e3]),
    np.array([0.02, 0.01, 0.03]),
    np.array([[20.0, 5.0], [16.0, -12.0], [12.0, 7.0]]),
    impact.Residual.none(2),
    ("lip", "stop"),
)
F = 10.0 * np.arange(1, 1201)
PORTS: dict[str, Any] = {"lip": (7, "+z"), "stop": (9, "-x")}


def modes(masses: np.ndarray, scale: np.ndarray, his: float = 0.0) -> list[dict[str, Any]]:
    """Shapes times ``scale``, with modal masses; node 8 is in the middle of nowhere."""
    return [
        mode_set(k + 1, f, zeta - his / 2, (0.0, 1.0, -stop * scale[k]), (lip * scale[k], 3.0, 0.0), masses[k], his)
        for k, (f, zeta, (lip, stop)) in enumerate(zip(BODY.frequencies_hz, BODY.zeta, BODY.shapes, strict=True))
    ]


def function(i: int, j: int, values: np.ndarray, x: np.ndarray = F, **changes: Any) -> dict[str, Any]:
    """Accelerance over frequency, from port j to port i."""
    (to, along), (of, pushed) = ((7, 3), (9, -1))[i], ((7, 3), (9, -1))[j]
    places = {"rsp_node": to, "rsp_dir": along, "ref_node": of, "ref_dir": pushed}
    return function_set(x, values, **{"ordinate_spec_data_type": 12} | places | changes)


S = 2j * np.pi * F
G = BODY.transfer(S)


def test_modes_in_their_own_units(tmp_path: Path) -> None:
    masses = np.array([1.0, 0.5, 4.0])  # kg, then as tonnes in a file of mm and N
    si = write_sets(tmp_path / "si.uff", unit_set(1.0, 1.0), *modes(masses, np.sqrt(masses)))
    mm = write_sets(tmp_path / "mm.uff", unit_set(1000.0, 1.0), *modes(masses / 1e3, np.sqrt(masses)))
    bare = write_sets(tmp_path / "bare.uff", *modes(masses / 1e3, np.sqrt(masses), his=0.004))
    for path, system in ((si, None), (mm, None), (bare, "mm-N-s")):
        read = read_modes_uff(path, ports=PORTS, system=system)  # type: ignore[arg-type]
        assert read.omega == pytest.approx(BODY.omega, rel=1e-5)  # 5 digits in the file
        assert read.zeta == pytest.approx(BODY.zeta, rel=1e-5)
        assert read.shapes == pytest.approx(BODY.shapes, rel=1e-4)
    mean = read_modes_uff(si, ports={"both": [(7, "+z"), (8, "-z")]}, compliance=1e-9, damping_ratio=0.1)
    assert mean.shapes[:, 0] == pytest.approx((BODY.shapes[:, 0] - 3 / np.sqrt(masses)) / 2, rel=1e-4)
    assert mean.zeta == pytest.approx([0.1] * 3)
    assert mean.residual.compliance[0, 0] == 1e-9


@pytest.mark.parametrize(("ordinate", "order"), [(8, 0), (11, 1), (12, 2)])
def test_frequency_responses_of_every_quantity(tmp_path: Path, ordinate: int, order: int) -> None:
    h = G * (S**order)[:, None, None] * 1e3  # mm/N
    pairs = [(0, 0), (1, 1), (1, 0)]
    sets = [function(i, j, h[:, i, j], ordinate_spec_data_type=ordinate) for i, j in pairs]
    read = read_frf_uff(write_sets(tmp_path / "frf.uff", unit_set(1000.0, 1.0), *sets), ports=PORTS)
    assert isinstance(read, FrequencyResponse)
    assert read.frequency == pytest.approx(F)
    assert np.abs(read.receptance - G).max() < 1e-9 * np.abs(G).max()
    turned = [function(1, 0, -h[:, 1, 0], rsp_dir=1, ordinate_spec_data_type=ordinate), *sets[:2]]
    read = read_frf_uff(write_sets(tmp_path / "turned.uff", *turned), ports=PORTS, system="mm-N-s")
    assert np.abs(read.receptance - G).max() < 1e-9 * np.abs(G).max()


@pytest.mark.slow
def test_from_a_hammer_test_to_a_greens_function(tmp_path: Path) -> None:
    h = G * (S**2)[:, None, None]
    sets = [function(i, j, h[:, i, j]) for i in range(2) for j in range(2)]
    fit = fit_poles(read_frf_uff(write_sets(tmp_path / "frf.uff", unit_set(1.0, 1.0), *sets), ports=PORTS))
    assert isinstance(fit, impact.ModalGreens)
    assert fit.omega == pytest.approx(BODY.omega, rel=1e-6)
    assert fit.provenance["file"] == "frf.uff"


def test_impulse_responses(tmp_path: Path) -> None:
    """Those of one port and of two, in millimetres, are those of the body; a velocity is refused."""
    t = 1e-5 * np.arange(500)
    g = np.array([[BODY.impulse_response(t, i, j) for j in range(2)] for i in range(2)])
    in_time = {"in_time": True, "ordinate_spec_data_type": 8}
    sets = [function(i, j, 1e3 * g[i, j], t, **in_time) for i, j in ((0, 0), (1, 0), (1, 1))]
    path = write_sets(tmp_path / "g.uff", *sets)
    for ports in (dict([*PORTS.items()][:1]), PORTS):
        read = read_impulse_response_uff(path, ports=ports, system="mm-N-s")
        assert read.values == pytest.approx(g[: len(ports), : len(ports)], abs=1e-9 * np.abs(g).max())
        assert read.ports == tuple(ports)
    with pytest.raises(UffError, match=r"no time response .*else / else; .*7:3/7:3"):
        read_impulse_response_uff(path, ports={"else": (8, "+z")}, system="SI")
    with pytest.raises(UffError, match=r"no displacement .*export"):
        read_impulse_response_uff(
            write_sets(tmp_path / "v.uff", function(0, 0, g[0, 0], t, in_time=True, ordinate_spec_data_type=11)),
            ports={"lip": PORTS["lip"]},
            system="SI",
        )


def test_pyuff_reads_what_is_written(tmp_path: Path) -> None:
    """Modes, nodes, units and responses are those of the body, by another reader of the format."""
    write_receptance_uff(BODY, F, tmp_path / "g.uff")
    units, *functions = pyuff.UFF(str(tmp_path / "g.uff")).read_sets()
    assert (units["length"], units["force"]) == (1.0, 1.0)
    ends = [(one["rsp_node"], one["ref_node"]) for one in functions]
    assert ends == [(1, 1), (2, 1), (2, 2)]
    for one, (i, j) in zip(functions, ends, strict=True):
        assert one["x"] == pytest.approx(F)
        assert np.abs(one["data"] - G[:, i - 1, j - 1]).max() < 1e-10 * np.abs(G).max()
    points, shapes = np.arange(6.0).reshape(2, 3), np.arange(12.0).reshape(2, 2, 3)
    write_modes_uff(points, shapes, np.array([10.0, 20.0]), np.array([0.5, 2.0]), tmp_path / "m.uff")
    _, nodes, *found = pyuff.UFF(str(tmp_path / "m.uff")).read_sets()
    assert np.allclose([nodes["x"], nodes["y"], nodes["z"]], points.T)
    assert [(one["freq"], one["modal_m"]) for one in found] == [(10.0, 0.5), (20.0, 2.0)]
    assert [one["r3"].tolist() for one in found] == shapes[:, :, 2].tolist()
