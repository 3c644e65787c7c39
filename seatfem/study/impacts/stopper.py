"""What is said of a stopper: its keys in summary.json, and what no error bar knows of it."""

from __future__ import annotations

from impact import measures
from impact.after.result import ImpactResult
from seatfem.study.scene import Scene


def stopper_keys(result: ImpactResult | None, filter_width: float) -> dict[str, object]:
    """The keys of its contact; none where there is no stopper. ``stopper_peak_force_N`` is raw, of a single step."""
    if result is None:
        return {}
    groups = measures.contact_groups(result)
    return {
        "stopper_peak_force_N": measures.peak_force(result),
        "stopper_filtered_peak_force_N": measures.filtered_peak_force(result, filter_width),
        "stopper_impulse_Ns": measures.impulse(result),
        "stopper_first_contact_s": float(groups[0, 0]) if len(groups) else None,
        "stopper_contact_count": len(groups),
    }


def stopper_notes(scene: Scene) -> tuple[str, ...]:
    """That the errors of a stopper that is computed or read are not known."""
    if scene.stopper is None or not scene.stopper.body.is_solved:
        return ()
    return (
        f"the stopper (kind {scene.stopper.body.kind!r}) is taken as its keys state it: what its mesh, reduction or "
        "data are off by is in no error bar, and what it takes in no prediction; refine its keys and compare",
    )
