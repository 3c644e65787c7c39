# ruff: noqa: I001 (one import a module)
from impact.exact.contact_stress import (
    ContactStressError as ContactStressError,
    HertzContact as HertzContact,
    HertzImpact as HertzImpact,
    ShearMaximum as ShearMaximum,
    circular_axis_stress as circular_axis_stress,
    circular_shear_maximum as circular_shear_maximum,
    disk_axis_stress as disk_axis_stress,
    disk_shear_maximum as disk_shear_maximum,
    edge_tension as edge_tension,
    first_contact_pressure as first_contact_pressure,
    hertz_circular as hertz_circular,
    hertz_impact as hertz_impact,
    hertz_line as hertz_line,
    hertz_stiffness as hertz_stiffness,
    line_axis_stress as line_axis_stress,
    line_shear_maximum as line_shear_maximum,
    midspan_step_stress as midspan_step_stress,
    pressure_wave_speed as pressure_wave_speed,
    reduced_modulus as reduced_modulus,
    rod_wave_speed as rod_wave_speed,
    tip_step_force as tip_step_force,
    tip_step_moment as tip_step_moment,
    tip_step_stress as tip_step_stress,
)
from impact.exact.closed_form import DampedFixedRod as DampedFixedRod, DampedFreeRod as DampedFreeRod
from impact.exact.half_space import point_step_response as point_step_response, rayleigh_speed as rayleigh_speed
from impact.exact import (
    closed_form as closed_form,
    contact_stress as contact_stress,
    half_space as half_space,
)
