"""Scene files: TOML with units in strings, checked with all errors at once."""

from seatfem.study.scene.load import load_scene, located
from seatfem.study.scene.models import Accuracy, Contact, Run, Scene
from seatfem.study.scene.problems import Problem, SceneError

__all__ = [
    "Accuracy",
    "Contact",
    "Problem",
    "Run",
    "Scene",
    "SceneError",
    "load_scene",
    "located",
]
