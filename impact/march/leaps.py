"""Integration of modal coordinates under known forces in steps of different lengths, as `impact.march.ladder` takes
them.

The contact forces are constant over each step, and each load is a mean and a straight rise: the recursion is exact for
such forces, and so are the energies.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from impact.bodies.body import ModalState
from impact.greens import oscillator
from impact.greens.base import Array
from impact.greens.modal import ModalGreens
from impact.march.grid import blocks
from impact.march.loop.compiled import compiled
from impact.march.loop.forces import FLOOR
from impact.march.replay import CACHED_VALUES, LEAST_TILE, Block, relax

_FORM = ((0, 0), (0, 1), (0, 2), (0, 3), (1, 1), (1, 2), (1, 3), (2, 2), (2, 3), (3, 3))


def find_loads(amplitudes: Array, ends: NDArray[np.int64]) -> tuple[Array, Array]:
    """Return the means and the rises (L, N) over steps with the ``ends`` (N + 1,) of loads with ``amplitudes`` (L, n),
    which are constant over each fine step [N]."""
    lengths, begins, finish = np.diff(ends), amplitudes[:, ends[:-1]], amplitudes[:, ends[1:] - 1]
    sums = np.concatenate([np.zeros((len(amplitudes), 1)), np.cumsum(amplitudes, axis=1)], axis=1)
    means = np.where(lengths > 1, (sums[:, ends[1:]] - sums[:, ends[:-1]]) / lengths, begins)
    return means, (finish - begins) * lengths / np.maximum(lengths - 1, 1)


class LeapReplay:
    """Modes, relaxations and bare compliance of one body, advanced under known forces in steps of several lengths.

    Each energy term is integrated by itself, pole by pole and step by step, none as a difference of others.
    """

    def __init__(
        self,
        modal: ModalGreens,
        spans: Array,
        start: ModalState,
        relaxed: Array,
        held: Array,
        loads: Sequence[Array],
        seen: Array | None = None,
    ) -> None:
        """Begin at the modal state ``start``, relaxations ``relaxed`` (R,) and forces ``held`` (P,) before t = 0.

        ``spans`` (J,): lengths of the steps [s]; ``loads``: their (M,) modal shapes; ``seen`` (o, P): weights of the
        sums over ports whose displacements are returned, by default each port's own.
        """
        rest, self._ports = modal.residual, modal.shapes.shape[1]
        self._shapes = np.vstack([modal.shapes.T, *loads])
        self._rates, self._spans = (modal.omega, modal.zeta), spans
        self._steps = np.array([_find_step(float(span), *self._rates) for span in spans])
        self._form: Array | None = None
        self._q, self._v = start.displacement.astype(float), start.velocity.astype(float)
        reach = -rest.rates * spans[:, None]
        gains = spans[:, None] * oscillator.expm1_over(reach), spans[:, None] * oscillator.expm1_over(2 * reach)
        self._relaxing = np.stack([np.exp(reach), *gains, np.tile(rest.rates, (len(spans), 1))], axis=1)
        self._amplitudes, self._compliance = np.ascontiguousarray(rest.shapes.T), rest.compliance
        self._y, self._last = relaxed.astype(float), held.astype(float)
        self._load_displacement = self._shapes[self._ports :] @ self._q
        self._seen = np.eye(self._ports) if seen is None else seen
        self._out = np.vstack([self._seen @ modal.shapes.T, *loads])
        self._tile = max(LEAST_TILE, CACHED_VALUES // (2 * self._q.size + self._y.size + 1))

    @property
    def stored(self) -> float:
        """Return the present elastic and kinetic energy of the body [J]."""
        swinging = float(np.sum(self._v**2) + np.sum((self._rates[0] * self._q) ** 2))
        return 0.5 * (swinging + float(self._relaxing[0, 3] @ self._y**2 + self._last @ self._compliance @ self._last))

    def advance(
        self, levels: NDArray[np.int64], force: Array, means: Array, rises: Array, *, energies: bool = True
    ) -> Block:
        """Advance through m steps of the spans with the numbers ``levels`` (m,), under port forces (P, m) and loads of
        ``means`` and ``rises`` (L, m); cheaper without ``energies``."""
        (ports, m), seen = force.shape, len(self._seen)
        u, stored, lost = np.zeros((len(self._out), m)), np.zeros(m), np.zeros(m if energies else 0)
        between = np.zeros((len(means), m))  # mean displacements at the loads
        if energies and self._form is None:
            forms = (oscillator.dissipation_form(float(span), *self._rates) for span in self._spans)
            self._form = np.array([[(1 + (i != j)) * form[i, j] for i, j in _FORM] for form in forms])
        form, moved = self._form if energies else None, bool(np.any(rises)) or None
        relaxing, springs = self._seen @ self._amplitudes, bool(np.any(self._compliance))
        for part in blocks(m, self._tile):
            q = np.ascontiguousarray(np.concatenate([force[:, part], means[:, part]]).T @ self._shapes)
            f = None if moved is None else np.ascontiguousarray(rises[:, part].T @ self._shapes[ports:])
            _swing(levels[part], self._steps, form, self._q, self._v, q, f, stored[part], lost[part])
            u[:, part] = self._out @ q.T
            if f is not None:
                between[:, part] = self._shapes[ports:] @ f.T
            if self._y.size:
                y = np.ascontiguousarray(force[:, part].T @ self._amplitudes)
                relax(levels[part], self._relaxing, self._y, y, stored[part], lost[part])
                u[:seen, part] += relaxing @ y.T
            if springs:
                yields = self._compliance @ force[:, part]
                u[:seen, part] += self._seen @ yields
                if energies:  # a spring loaded by a step stores F^2 c/2
                    jump = np.diff(force[:, part], axis=1, prepend=self._last[:, None])
                    stored[part] += 0.5 * np.sum(force[:, part] * yields, axis=0)
                    lost[part] += 0.5 * np.sum(jump * (self._compliance @ jump), axis=0)
            self._last = force[:, part.stop - 1].copy()
        before = np.concatenate([self._load_displacement[:, None], u[seen:, :-1]], axis=1)
        work = np.sum(means * (u[seen:] - before), axis=0)
        if moved is not None:
            work += np.sum(rises * ((u[seen:] + before) / 2 - between), axis=0)
        self._load_displacement = u[seen:, -1].copy()
        return Block(u[:seen], stored, lost, work)


def _find_step(span: float, omega: Array, zeta: Array) -> Array:
    """Return (13, K): transition of (q, q'), effects of a unit force and of a unit rise about 0, means of q by q, q',
    force and rise, and w^2, over one ``span`` [s]."""
    ((a11, a12), (a21, a22)), (b1, b2) = oscillator.transition(span, omega, zeta)
    full = np.full(omega.shape, span)
    ramped, far = oscillator.ramp_response(full, omega, zeta), oscillator.ramp_integral(full, omega, zeta)
    effects = b1, b2, ramped / span - b1 / 2, b1 / span - b2 / 2
    means = 1 - omega**2 * ramped / span, b1 / span, ramped / span, far / span**2 - ramped / (2 * span)
    return np.array([a11, a12, a21, a22, *effects, *means, omega**2])


@compiled(nogil=True, fastmath={"reassoc", "contract", "nsz"})
def _swing(levels, steps, form, q, v, pushed, rises, stored, lost):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    """Advance oscillators under modal forces ``pushed`` (m, K), which become their coordinates after each step.

    steps (J, 13, K): of `_find_step`; rises (m, K), which become the means of the coordinates, or None; form (J, 10,
    K): of the energy that damping takes, or None for no energies.
    """
    for m in range(pushed.shape[0]):
        step, f, stored_now, lost_now = steps[levels[m]], pushed[m], 0.0, 0.0
        if form is not None:
            d = form[levels[m]]
        for k in range(q.size):
            x, y, a, b = q[k], v[k], f[k], 0.0
            r = step[0, k] * x + step[1, k] * y + step[4, k] * a
            s = step[2, k] * x + step[3, k] * y + step[5, k] * a + FLOOR
            if rises is not None:
                b = rises[m, k]
                r += step[6, k] * b
                s += step[7, k] * b
                rises[m, k] = step[8, k] * x + step[9, k] * y + step[10, k] * a + step[11, k] * b
            if form is not None:
                lost_now += x * (d[0, k] * x + d[1, k] * y + d[2, k] * a)
                lost_now += y * (d[4, k] * y + d[5, k] * a) + d[7, k] * a * a
                if rises is not None:
                    lost_now += b * (d[3, k] * x + d[6, k] * y + d[8, k] * a + d[9, k] * b)
                stored_now += s * s + step[12, k] * r * r
            q[k], v[k], f[k] = r, s, r
        if form is not None:
            stored[m] += 0.5 * stored_now
            lost[m] += lost_now
