"""Scene files: TOML with units in strings, checked with all errors at once."""

from seatfem.structures.kinds.imported import FrequencyResponseFile, Matrices, UniversalModes
from seatfem.structures.kinds.parts import GreensSettings, Material, Mesh, Rayleigh
from seatfem.structures.kinds.seats import (
    METRES,
    Annular,
    BarSeat,
    BlockSeat,
    Cad,
    Conical,
    DrawnSeat,
    ElasticSeat,
    GreensFile,
    MeshFile,
    Plate,
    RevolvedSeat,
    Rod,
    Spring,
    StopperSeat,
)
from seatfem.study.scene.load import load_scene, located
from seatfem.study.scene.models import Accuracy, Cantilever, Contact, Release, RigidMass, Run, Scene
from seatfem.study.scene.problems import Problem, SceneError

__all__ = [
    "METRES",
    "Accuracy",
    "Annular",
    "BarSeat",
    "BlockSeat",
    "Cad",
    "Cantilever",
    "Conical",
    "Contact",
    "DrawnSeat",
    "ElasticSeat",
    "FrequencyResponseFile",
    "GreensFile",
    "GreensSettings",
    "Material",
    "Matrices",
    "Mesh",
    "MeshFile",
    "Plate",
    "Problem",
    "Rayleigh",
    "Release",
    "RevolvedSeat",
    "RigidMass",
    "Rod",
    "Run",
    "Scene",
    "SceneError",
    "Spring",
    "StopperSeat",
    "UniversalModes",
    "load_scene",
    "located",
]
