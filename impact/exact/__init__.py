"""Closed forms: Green's functions of rods, springs, beams, plates and the half-space, stresses at contacts."""

from typing import TYPE_CHECKING

from impact.names import lazy_names

if TYPE_CHECKING:
    from impact.exact.contact_stress import ContactStressError as ContactStressError
    from impact.exact.contact_stress import HertzContact as HertzContact
    from impact.exact.contact_stress import HertzImpact as HertzImpact
    from impact.exact.contact_stress import ShearMaximum as ShearMaximum
    from impact.exact.contact_stress import circular_axis_stress as circular_axis_stress
    from impact.exact.contact_stress import circular_shear_maximum as circular_shear_maximum
    from impact.exact.contact_stress import disk_axis_stress as disk_axis_stress
    from impact.exact.contact_stress import disk_shear_maximum as disk_shear_maximum
    from impact.exact.contact_stress import edge_tension as edge_tension
    from impact.exact.contact_stress import first_contact_pressure as first_contact_pressure
    from impact.exact.contact_stress import hertz_circular as hertz_circular
    from impact.exact.contact_stress import hertz_impact as hertz_impact
    from impact.exact.contact_stress import hertz_line as hertz_line
    from impact.exact.contact_stress import hertz_stiffness as hertz_stiffness
    from impact.exact.contact_stress import line_axis_stress as line_axis_stress
    from impact.exact.contact_stress import line_shear_maximum as line_shear_maximum
    from impact.exact.contact_stress import midspan_step_stress as midspan_step_stress
    from impact.exact.contact_stress import pressure_wave_speed as pressure_wave_speed
    from impact.exact.contact_stress import reduced_modulus as reduced_modulus
    from impact.exact.contact_stress import rod_wave_speed as rod_wave_speed
    from impact.exact.contact_stress import tip_step_force as tip_step_force
    from impact.exact.contact_stress import tip_step_moment as tip_step_moment
    from impact.exact.contact_stress import tip_step_stress as tip_step_stress
    from impact.exact.damped_rods import DampedFixedRod as DampedFixedRod
    from impact.exact.damped_rods import DampedFreeRod as DampedFreeRod
    from impact.exact.disk_response import point_step_response as point_step_response
    from impact.exact.disk_response import rayleigh_speed as rayleigh_speed

__all__ = [
    "ContactStressError",
    "DampedFixedRod",
    "DampedFreeRod",
    "HertzContact",
    "HertzImpact",
    "ShearMaximum",
    "circular_axis_stress",
    "circular_shear_maximum",
    "disk_axis_stress",
    "disk_shear_maximum",
    "edge_tension",
    "first_contact_pressure",
    "hertz_circular",
    "hertz_impact",
    "hertz_line",
    "hertz_stiffness",
    "line_axis_stress",
    "line_shear_maximum",
    "midspan_step_stress",
    "point_step_response",
    "pressure_wave_speed",
    "rayleigh_speed",
    "reduced_modulus",
    "rod_wave_speed",
    "tip_step_force",
    "tip_step_moment",
    "tip_step_stress",
]

__getattr__ = lazy_names(
    __name__,
    {
        "impact.exact.contact_stress": "ContactStressError HertzContact HertzImpact ShearMaximum circular_axis_stress "
        "circular_shear_maximum disk_axis_stress disk_shear_maximum edge_tension "
        "first_contact_pressure hertz_circular hertz_impact hertz_line hertz_stiffness "
        "line_axis_stress line_shear_maximum midspan_step_stress pressure_wave_speed "
        "reduced_modulus rod_wave_speed tip_step_force tip_step_moment tip_step_stress",
        "impact.exact.damped_rods": "DampedFixedRod DampedFreeRod",
        "impact.exact.disk_response": "point_step_response rayleigh_speed",
    },
)
