"""Scene files: TOML with units in strings, checked with all errors at once."""

from seatfem.scene.load import load_scene
from seatfem.scene.models import Accuracy, Cantilever, Contact, Release, RigidMass, Run, Scene
from seatfem.scene.parts import GreensSettings, Material, Mesh, Rayleigh
from seatfem.scene.problems import Problem, SceneError
from seatfem.scene.seats import (
    METRES,
    Annular,
    BarSeat,
    BlockSeat,
    Cad,
    DrawnSeat,
    ElasticSeat,
    GreensFile,
    MeshFile,
    Rod,
    Spring,
)

__all__ = [
    "METRES",
    "Accuracy",
    "Annular",
    "BarSeat",
    "BlockSeat",
    "Cad",
    "Cantilever",
    "Contact",
    "DrawnSeat",
    "ElasticSeat",
    "GreensFile",
    "GreensSettings",
    "Material",
    "Mesh",
    "MeshFile",
    "Problem",
    "Rayleigh",
    "Release",
    "RigidMass",
    "Rod",
    "Run",
    "Scene",
    "SceneError",
    "Spring",
    "load_scene",
]
