# ruff: noqa: I001 (one import a module)
from impact.gas.compressor import (
    Compressor as Compressor,
    GasHistory as GasHistory,
    Prescribed as Prescribed,
    gas_history as gas_history,
    isentropic as isentropic,
)
from impact.gas.flow import (
    AreaTable as AreaTable,
    GasError as GasError,
    PerfectGas as PerfectGas,
    Plenum as Plenum,
    ReedValve as ReedValve,
    SliderCrank as SliderCrank,
    of_molar_mass as of_molar_mass,
    port_flow as port_flow,
    port_force as port_force,
)
