"""Bodies with many ports: what it takes to prepare their contact, and each pair of ports on its own."""

from __future__ import annotations

import numpy as np
from table import Table, best, publish

import impact

PORTS, MODES, DT = (16, 32, 64), 40, 1e-7


def main() -> None:
    """Two bodies of 40 modes that touch at every port."""
    rows = []
    for ports in PORTS:
        body = _body(ports)
        problem = impact.ContactProblem(
            impact.Body(body), contacts=[impact.Contact(_SEAT[ports], port=i, striker_port=i) for i in range(ports)]
        )
        own = best(lambda g=body: g.step_matrix(DT))  # type: ignore[misc]
        pairs = best(lambda g=body: _pair_by_pair(g), repeats=1)  # type: ignore[misc]
        ready = best(lambda p=problem: impact.prepare(p, DT, 1e-5))  # type: ignore[misc]
        rows.append((str(ports), f"{1e3 * own:.2f}", f"{1e3 * pairs:.0f}", f"{1e3 * ready:.0f}"))
    notes = (f"Milliseconds on one core, {MODES} modes: W_0 at once, pair by pair, and all of `impact.prepare`.",)
    columns = ("ports", "step_matrix", "pair by pair", "prepare")
    publish("many_ports", Table("Many ports", notes, columns, tuple(rows)))


def _body(ports: int) -> impact.ModalGreens:
    random = np.random.default_rng(ports)
    return impact.ModalGreens(
        2 * np.pi * np.geomspace(1e3, 1e6, MODES),
        np.full(MODES, 0.01),
        random.standard_normal((MODES, ports)),
        impact.Residual.spring(1e-9 * np.eye(ports)),
        tuple(str(k) for k in range(ports)),
    )


def _pair_by_pair(greens: impact.ModalGreens) -> None:
    p = range(len(greens.ports))
    for i in p:
        for j in p:
            greens.step_response(DT, i, j)


_SEAT = {ports: impact.Body(_body(ports)) for ports in PORTS}

if __name__ == "__main__":
    main()
