"""Scene files: TOML with units in strings, checked with all errors at once."""

from seatfem.study.scene.contact import Contact
from seatfem.study.scene.load import load_scene, located
from seatfem.study.scene.models import Scene
from seatfem.study.scene.problems import Problem, SceneError
from seatfem.study.scene.run import Accuracy, Run

__all__ = ["Accuracy", "Contact", "Problem", "Run", "Scene", "SceneError", "load_scene", "located"]
