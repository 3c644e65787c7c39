# ruff: noqa: I001 (one import a module)
from impact.gas.compressor import (
    Compressor as Compressor,
    GasHistory as GasHistory,
    Prescribed as Prescribed,
    gas_history as gas_history,
    isentropic as isentropic,
)
from impact.gas.cylinder import Plenum as Plenum, SliderCrank as SliderCrank
from impact.gas.nozzle import GasError as GasError, PerfectGas as PerfectGas, of_molar_mass as of_molar_mass
from impact.gas.valve import (
    AreaTable as AreaTable,
    ReedValve as ReedValve,
    port_flow as port_flow,
    port_force as port_force,
)
