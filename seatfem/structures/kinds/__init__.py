"""Kinds of structures, imported here so that scenes may name them.

A kind from another package is known once its subclass of `Structure` is defined.
"""

from seatfem.structures.kinds.blocks import BarSeat as BarSeat
from seatfem.structures.kinds.blocks import BlockSeat as BlockSeat
from seatfem.structures.kinds.blocks import Plate as Plate
from seatfem.structures.kinds.closed_forms import RigidMass as RigidMass
from seatfem.structures.kinds.closed_forms import Rod as Rod
from seatfem.structures.kinds.closed_forms import Spring as Spring
from seatfem.structures.kinds.from_files import Cad as Cad
from seatfem.structures.kinds.from_files import MeshFile as MeshFile
from seatfem.structures.kinds.measured import FrequencyResponseFile as FrequencyResponseFile
from seatfem.structures.kinds.measured import GreensFile as GreensFile
from seatfem.structures.kinds.measured import Matrices as Matrices
from seatfem.structures.kinds.measured import UniversalModes as UniversalModes
from seatfem.structures.kinds.plates import Disc as Disc
from seatfem.structures.kinds.plates import Flapper as Flapper
from seatfem.structures.kinds.plates import RingPlate as RingPlate
from seatfem.structures.kinds.reeds import Cantilever as Cantilever
from seatfem.structures.kinds.reeds import ClampedClamped as ClampedClamped
from seatfem.structures.kinds.reeds import Stepped as Stepped
from seatfem.structures.kinds.reeds import Timoshenko as Timoshenko
from seatfem.structures.kinds.reeds import TipMass as TipMass
from seatfem.structures.kinds.sheet import OutlinedSheet as OutlinedSheet
from seatfem.structures.kinds.structure import Structure as Structure
from seatfem.structures.kinds.structure import kinds_of as kinds_of
from seatfem.structures.kinds.turned import Annular as Annular
from seatfem.structures.kinds.turned import Ball as Ball
from seatfem.structures.kinds.turned import Conical as Conical
from seatfem.structures.kinds.turned import StopperSeat as StopperSeat
