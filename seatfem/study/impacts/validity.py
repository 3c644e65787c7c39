"""Where the theory behind a scene ends: thick reeds, large deflections, filters beyond a measured band."""

from __future__ import annotations

from typing import Final

from impact.advice import Advice
from impact.greens.base import GreensFunction
from seatfem.study.scene import Cantilever, Scene

SLENDER: Final = 0.2  # thickness over length beyond which a reed is no beam: shear adds 3 % to its compliance
SHEAR: Final = 0.25 * 2 * (1 + 0.3) / (5 / 6)  # of the tip's compliance, over (thickness/length)^2; Poisson ratio 0.3
STIFFENING: Final = 36 / 35  # of a cantilever under a tip force, over (deflection/length)^2
DEFLECTED: Final = 0.1  # deflection over length from which on that is 1 %


def thick_reed(scene: Scene) -> str:
    """Why the reed is no slender beam; "" where it is one."""
    reed = scene.reed
    if not isinstance(reed, Cantilever) or reed.thickness <= SLENDER * reed.length:
        return ""
    return (
        f"reed.thickness = {1e3 * reed.thickness:g} mm over reed.length = {1e3 * reed.length:g} mm is "
        f"{reed.thickness / reed.length:.2g} (limit {SLENDER:g}): a beam so thick bends by shear too, which is not "
        "modelled; take a thinner or longer reed, or a rigid mass"
    )


def shear_error(scene: Scene) -> float:
    """Relative error of the reed's compliance for want of shear, 3 EI/(kappa G A L^2), L to the contact.

    Source: S. P. Timoshenko, Phil. Mag. 41 (1921) 744; kappa = 5/6, Poisson ratio 0.3.
    """
    reed = scene.reed
    if not isinstance(reed, Cantilever):
        return 0.0
    reach = reed.length if scene.contact.at is None else scene.contact.at
    return SHEAR * (reed.thickness / reach) ** 2


def validity_advice(scene: Scene, seat: GreensFunction | None = None) -> tuple[Advice, ...]:
    """What the run answers beyond the limits of its theory or of its data.

    The elastica of a cantilever under a tip force needs (1 + (36/35)(d/L)^2) of the linear force for the deflection d,
    to second order; of its thickness this is independent. Source: K. E. Bisshopp and D. C. Drucker, Large deflection of
    cantilever beams, Quart. Appl. Math. 3 (1945) 272.
    """
    found, reed = [], scene.reed
    if isinstance(reed, Cantilever) and (relative := abs(reed.release.tip_deflection) / reed.length) > DEFLECTED:
        strain = 1.5 * relative * reed.thickness / reed.length
        found.append(
            Advice(
                "release.tip_deflection over reed.length",
                relative,
                DEFLECTED,
                f"the reed's theory is linear; at {abs(reed.release.tip_deflection) / reed.thickness:.3g} thicknesses "
                f"it is stiffer by about {STIFFENING * relative**2:.2g} of itself (strain {strain:.2g}), and "
                "no bar knows",
                f"release it from at most {1e3 * DEFLECTED * reed.length:.3g} mm, or take a longer reed",
            )
        )
    band = None if seat is None else _measured_band(seat)
    if band is not None and scene.run.filter_width < 1 / band:
        found.append(
            Advice(
                "1/run.filter_width over the measured band",
                1 / (scene.run.filter_width * band),
                1.0,
                f"the seat was measured up to {band:.4g} Hz; what a filter of {scene.run.filter_width:.3g} s passes "
                "beyond is a guess, and no bar knows",
                f"use run.filter_width >= {1 / band:.3g} s, or measure further",
            )
        )
    return tuple(found)


def _measured_band(seat: GreensFunction) -> float | None:
    """Highest line of a fit to measured responses [Hz]."""
    fit = seat.provenance.get("fit")
    band = fit.get("band_hz") if isinstance(fit, dict) else None
    return float(band[1]) if isinstance(band, list | tuple) and len(band) == 2 else None
