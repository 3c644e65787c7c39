"""Gas through a reed valve, and in the cylinder behind it."""

from typing import TYPE_CHECKING

from impact.names import lazy_names

if TYPE_CHECKING:
    from impact.gas.compressor import Compressor as Compressor
    from impact.gas.compressor import GasHistory as GasHistory
    from impact.gas.compressor import Prescribed as Prescribed
    from impact.gas.compressor import gas_history as gas_history
    from impact.gas.compressor import isentropic as isentropic
    from impact.gas.cylinder import Plenum as Plenum
    from impact.gas.cylinder import SliderCrank as SliderCrank
    from impact.gas.nozzle import GasError as GasError
    from impact.gas.nozzle import PerfectGas as PerfectGas
    from impact.gas.nozzle import of_molar_mass as of_molar_mass
    from impact.gas.valve import AreaTable as AreaTable
    from impact.gas.valve import ReedValve as ReedValve
    from impact.gas.valve import port_flow as port_flow
    from impact.gas.valve import port_force as port_force

__all__ = [
    "AreaTable",
    "Compressor",
    "GasError",
    "GasHistory",
    "PerfectGas",
    "Plenum",
    "Prescribed",
    "ReedValve",
    "SliderCrank",
    "gas_history",
    "isentropic",
    "of_molar_mass",
    "port_flow",
    "port_force",
]

__getattr__ = lazy_names(
    __name__,
    {
        "impact.gas.compressor": "Compressor GasHistory Prescribed gas_history isentropic",
        "impact.gas.cylinder": "Plenum SliderCrank",
        "impact.gas.nozzle": "GasError PerfectGas of_molar_mass",
        "impact.gas.valve": "AreaTable ReedValve port_flow port_force",
    },
)
