# ruff: noqa: I001 (one import a module)
from seatfem.structures.kinds.blocks import BarSeat as BarSeat, BlockSeat as BlockSeat, Plate as Plate
from seatfem.structures.kinds.closed_forms import RigidMass as RigidMass, Rod as Rod, Spring as Spring
from seatfem.structures.kinds.from_files import Cad as Cad, MeshFile as MeshFile
from seatfem.structures.kinds.measured import FrequencyResponseFile as FrequencyResponseFile
from seatfem.structures.kinds.plates import (
    Disc as Disc,
    Flapper as Flapper,
    HeldDisc as HeldDisc,
    RingPlate as RingPlate,
)
from seatfem.structures.kinds.reeds import (
    Cantilever as Cantilever,
    ClampedClamped as ClampedClamped,
    Stepped as Stepped,
    Timoshenko as Timoshenko,
    TipMass as TipMass,
)
from seatfem.structures.kinds.sheet import OutlinedSheet as OutlinedSheet
from seatfem.structures.kinds.stored import (
    GreensFile as GreensFile,
    Matrices as Matrices,
    UniversalModes as UniversalModes,
)
from seatfem.structures.kinds.structure import Structure as Structure, kinds_of as kinds_of
from seatfem.structures.kinds.turned import (
    Annular as Annular,
    Ball as Ball,
    Conical as Conical,
    StopperSeat as StopperSeat,
)
from seatfem.structures.kinds import (
    beam as beam,
    blocks as blocks,
    closed_forms as closed_forms,
    drawn as drawn,
    elastic as elastic,
    from_files as from_files,
    measured as measured,
    motion as motion,
    parts as parts,
    plate_loads as plate_loads,
    plates as plates,
    reeds as reeds,
    selectors as selectors,
    sheet as sheet,
    stored as stored,
    structure as structure,
    thin_plate as thin_plate,
    turned as turned,
)
