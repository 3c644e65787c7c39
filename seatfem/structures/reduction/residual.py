"""The passive residual that replaces truncated modes, and checks of Green's functions: reciprocity, passivity."""

import numpy as np

from impact.greens import modal, poles
from impact.measured.vector_fitting import pole_passivity
from seatfem.structures.model import Array, Damping, SecondOrderModel
from seatfem.structures.reduction.eigen_search import ConvergenceError


def reciprocity(matrix: Array) -> float:
    """Return max |G - G'| / max |G| for (p, p) or (p, p, n) values: 0 for a reciprocal Green's function."""
    largest = float(np.abs(matrix).max())
    return float(np.abs(matrix - np.swapaxes(matrix, 0, 1)).max()) / largest if largest else 0.0


def passivity(greens: modal.ModalGreens) -> dict[str, object]:
    """Return whether a modal Green's function is passive, and the margins: modes with zeta >= 0, relaxations with
    positive rates and a positive semidefinite residual compliance cannot gain energy."""
    compliance = float(np.linalg.eigvalsh(greens.residual.compliance)[0])
    least = float(greens.zeta.min(initial=np.inf))
    return {
        "passive": bool(least >= 0 and compliance >= 0 and np.all(greens.residual.rates >= 0)),
        "least_damping_ratio": least if np.isfinite(least) else None,
        "least_residual_compliance": compliance,
    }


def passivity_of_poles(greens: poles.PoleGreens) -> dict[str, object]:
    """Return whether a Green's function of complex poles is passive, by its mobility's real part at all frequencies."""
    verdict = pole_passivity(greens)
    return {"passive": verdict.passive, "margin": verdict.margin, "margin_at_Hz": verdict.frequency}


def feeding(model: SecondOrderModel, damping: Damping) -> str:
    """Return in words how the model's damping would add energy; "" if it does not, by the diagonal of C."""
    least = 0.0 if model.C is None else float(model.C.diagonal().min(initial=0.0))
    if least < 0:
        return f"C has a diagonal value {least:g}: it must not be negative and feed energy"
    return "" if damping.coupling else damping.refusal


_LEAST = 1e-9  # least initial velocity over the largest, to exclude round-off


def residual(left_out: Array, model: SecondOrderModel, damping: Damping) -> modal.Residual:
    """Return a passive replacement for modes above the band, of static compliance R0 = ``left_out`` (p, p) [m/N].

    It is the `relaxation` with g(0+) of the continuum, 1/Z times `Damping.first_velocity`, or a bare spring if the
    impedance of a port is unknown.
    """
    impedances = [port.impedance for port in model.ports.values()]
    if any(z is None for z in impedances):
        if damping.beta == 0:
            return modal.Residual.spring(left_out)
        impedances = [1e-9 * damping.beta / max(r, 1e-300) for r in np.diag(left_out)]
    start = np.diag(damping.first_velocity() / np.array(impedances, dtype=float))
    return relaxation((left_out + left_out.T) / 2, start, damping.beta)


def semidefinite(rest: Array, allowed: float) -> Array:
    """Return a compliance (p, p) without negative eigenvalues; raises `ConvergenceError` if they exceed ``allowed``."""
    values, vectors = np.linalg.eigh((rest + rest.T) / 2)
    if len(values) and values[0] < -allowed:
        raise ConvergenceError(
            f"the modes exceed the static compliance by {-values[0]:.2e} m/N: not converged; check the units, or use "
            "method='krylov'"
        )
    return np.asarray(vectors * np.maximum(values, 0.0) @ vectors.T)


def relaxation(compliance: Array, start: Array, beta: float) -> modal.Residual:
    """Return the exponential with integral R0 = ``compliance`` (p, p) [m/N] and g(0+) = ``start`` (p, p) [m/(N s)].

    tau = R0/g(0+) for one port. Stiffness-proportional damping changes it to tau + ``beta``: modes far above 2/beta are
    overdamped and creep as exp(-t/beta), like a spring parallel to a dashpot of ratio beta [s].
    """
    scale, vectors = np.linalg.eigh(start)
    scale = np.sqrt(np.maximum(scale, _LEAST * scale[-1]))
    root, back = vectors * scale @ vectors.T, vectors / scale @ vectors.T
    taus, turn = np.linalg.eigh(back @ compliance @ back)
    taus = np.maximum(taus, 0.0)  # round-off
    slowed = np.where(taus > 0, taus / (np.where(taus > 0, taus, 1.0) + beta), 1.0)
    return modal.Residual.exponential(root @ (turn * taus) @ turn.T @ root, root @ (turn * slowed) @ turn.T @ root)


def truncate(
    omega: Array, zeta: Array, shapes: Array, above: float, extra: Array, model: SecondOrderModel, damping: Damping
) -> modal.ModalGreens:
    """Return modes up to the angular frequency ``above``; the others' compliance, plus ``extra``, as residual.

    Args:
        omega, zeta, shapes: (m,), (m,) and (m, p) mass-normalised modes.
        above: highest retained angular frequency [rad/s].
        extra: (p, p) static compliance known to be in no mode at all [m/N].
    """
    kept = omega <= above
    dropped = shapes[~kept] / omega[~kept, None]
    tail = damping
    if damping.loss is not None:  # mean loss of the dropped modes, weighted by their compliance
        elastic = omega > 0 if kept.all() else ~kept
        share = np.sum((shapes[elastic] / omega[elastic, None]) ** 2, axis=1)
        lost = (zeta - damping.ratios(omega))[elastic]
        tail = damping.plus(float(share @ lost / share.sum()))
    rest = residual(dropped.T @ dropped + extra, model, tail)
    return modal.ModalGreens(omega[kept], zeta[kept], shapes[kept], rest, model.port_names)
