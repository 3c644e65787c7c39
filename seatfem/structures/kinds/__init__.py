"""Kinds of structures, one file each: imported here, they are what scenes may name.

A kind from elsewhere is a subclass of `Structure` too, known from its definition on.
"""

from seatfem.structures.kinds.annular import Annular
from seatfem.structures.kinds.bar import BarSeat
from seatfem.structures.kinds.block import BlockSeat
from seatfem.structures.kinds.cad import Cad
from seatfem.structures.kinds.cantilever import Cantilever
from seatfem.structures.kinds.clamped_clamped import ClampedClamped
from seatfem.structures.kinds.conical import Conical
from seatfem.structures.kinds.frf import FrequencyResponseFile
from seatfem.structures.kinds.greens_file import GreensFile
from seatfem.structures.kinds.matrices import Matrices
from seatfem.structures.kinds.mesh_file import MeshFile
from seatfem.structures.kinds.modes import UniversalModes
from seatfem.structures.kinds.plate import Plate
from seatfem.structures.kinds.rigid_mass import RigidMass
from seatfem.structures.kinds.rod import Rod
from seatfem.structures.kinds.spring import Spring
from seatfem.structures.kinds.stopper import StopperSeat
from seatfem.structures.kinds.structure import Structure, kinds_of
from seatfem.structures.kinds.timoshenko import Timoshenko
from seatfem.structures.kinds.tip_mass import TipMass

__all__ = [
    "Annular",
    "BarSeat",
    "BlockSeat",
    "Cad",
    "Cantilever",
    "ClampedClamped",
    "Conical",
    "FrequencyResponseFile",
    "GreensFile",
    "Matrices",
    "MeshFile",
    "Plate",
    "RigidMass",
    "Rod",
    "Spring",
    "StopperSeat",
    "Structure",
    "Timoshenko",
    "TipMass",
    "UniversalModes",
    "kinds_of",
]
