# ruff: noqa: I001 (one import a module)
from impact.notices import Advice as Advice, SeatfemError as SeatfemError
from impact.after import measures as measures
from impact.after.histories import PeakStress as PeakStress, ReedStress as ReedStress
from impact.after.landings import ContactRecord as ContactRecord, Landing as Landing, find_landings as find_landings
from impact.after.regime import Regime as Regime, regime_card as regime_card
from impact.after.result import EnergyLedger as EnergyLedger, ImpactResult as ImpactResult
from impact.after.rods import (
    axial_force as axial_force,
    displacement_response as displacement_response,
    fixed_rod_modes as fixed_rod_modes,
    force_response as force_response,
    modal_displacement as modal_displacement,
    rod_axial_force as rod_axial_force,
    rod_displacement as rod_displacement,
    rod_stress as rod_stress,
)
from impact.after.stresses import (
    bending_stress as bending_stress,
    peak_bending_stress as peak_bending_stress,
    reed_stress as reed_stress,
)
from impact.beams.euler_bernoulli import (
    Cantilever as Cantilever,
    ClampedClamped as ClampedClamped,
    TipMassCantilever as TipMassCantilever,
)
from impact.beams.stepped import SteppedCantilever as SteppedCantilever
from impact.beams.timoshenko import TimoshenkoCantilever as TimoshenkoCantilever
from impact.bodies.loads import (
    BaseMotion as BaseMotion,
    Gravity as Gravity,
    PointForce as PointForce,
    Pressure as Pressure,
    PressureField as PressureField,
)
from impact.bodies.body import (
    Body as Body,
    IncomingWave as IncomingWave,
    Load as Load,
    ModalState as ModalState,
    rigid_mass as rigid_mass,
)
from impact.bodies.reeds import (
    GivenShape as GivenShape,
    ModeShape as ModeShape,
    StaticShape as StaticShape,
    cantilever_reed as cantilever_reed,
    reed as reed,
)
from impact.bodies.time_series import TimeSeries as TimeSeries, read_time_series as read_time_series
from impact.exact.closed_form import (
    fixed_rod as fixed_rod,
    free_rod as free_rod,
    infinite_beam as infinite_beam,
    infinite_plate as infinite_plate,
    rod_of_two_ends as rod_of_two_ends,
    rod_with_end_impedance as rod_with_end_impedance,
    semi_infinite_rod as semi_infinite_rod,
    single_mode as single_mode,
    spring as spring,
)
from impact.exact.half_space import (
    HalfSpacePatch as HalfSpacePatch,
    disk_compliance as disk_compliance,
    half_space_patch as half_space_patch,
    punch_compliance as punch_compliance,
    square_compliance as square_compliance,
    without_patch as without_patch,
)
from impact.greens.base import (
    ErrorEstimate as ErrorEstimate,
    GreensFunction as GreensFunction,
    GreensFunctionError as GreensFunctionError,
    ScaledGreens as ScaledGreens,
    StepKernel as StepKernel,
    SumGreens as SumGreens,
)
from impact.greens.modal import ModalGreens as ModalGreens, Residual as Residual
from impact.greens.passivity import (
    PassivityReport as PassivityReport,
    PolePassivity as PolePassivity,
    passivity as passivity,
    pole_passivity as pole_passivity,
    repair as repair,
    require_passive as require_passive,
    sampling_advice as sampling_advice,
)
from impact.greens.poles import (
    PoleGreens as PoleGreens,
    StateSpace as StateSpace,
    receptance as receptance,
    state_space as state_space,
)
from impact.greens.sampled import SampledGreens as SampledGreens
from impact.march.laws import (
    CompiledLaw as CompiledLaw,
    Hertz as Hertz,
    HertzOnPatch as HertzOnPatch,
    HuntCrossley as HuntCrossley,
    Law as Law,
    LawError as LawError,
    LinearSpring as LinearSpring,
    PlainLaw as PlainLaw,
    RoughJoint as RoughJoint,
    Signorini as Signorini,
    SqueezeFilm as SqueezeFilm,
    TableJoint as TableJoint,
    compiled_law as compiled_law,
)
from impact.march.prepared import prepare as prepare
from impact.march.problem import Contact as Contact, ContactError as ContactError, ContactProblem as ContactProblem
from impact.march.stepper import ContactStepper as ContactStepper, StepState as StepState
from impact.measured.frf import (
    FrequencyResponse as FrequencyResponse,
    read_impulse_response as read_impulse_response,
)
from impact.measured.pole_fit import fit_poles as fit_poles
from impact.pictures.lip_plots import plot_lip as plot_lip
from impact.pictures.plots import (
    plot_energy as plot_energy,
    plot_force as plot_force,
    plot_greens as plot_greens,
    plot_motion as plot_motion,
)
from impact.runs.batch import ImpactBatch as ImpactBatch, solve_many as solve_many
from impact.runs.variations import Budget as Budget
from impact.runs.solver import (
    Coarser as Coarser,
    Horizon as Horizon,
    collect as collect,
    error_budget as error_budget,
    measure_horizon as measure_horizon,
    solve as solve,
)
from impact.storage.hdf5 import (
    StorageError as StorageError,
    load_greens as load_greens,
    load_results as load_results,
    restore_checkpoint as restore_checkpoint,
    save_checkpoint as save_checkpoint,
    save_greens as save_greens,
    save_results as save_results,
)
from impact import (
    after as after,
    beams as beams,
    bodies as bodies,
    exact as exact,
    files as files,
    gas as gas,
    greens as greens,
    life as life,
    march as march,
    measured as measured,
    names as names,
    notices as notices,
    pictures as pictures,
    quantities as quantities,
    runs as runs,
    storage as storage,
)
