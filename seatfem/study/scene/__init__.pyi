# ruff: noqa: I001 (one import a module)
from seatfem.study.scene.contact import Contact as Contact
from seatfem.study.scene.lips import ContactGeometry as ContactGeometry
from seatfem.study.scene.load import load_scene as load_scene
from seatfem.study.scene.tables import located as located
from seatfem.study.scene.models import Scene as Scene
from seatfem.study.scene.problems import Problem as Problem, SceneError as SceneError
from seatfem.study.scene.run import Accuracy as Accuracy, Run as Run
from seatfem.study.scene import (
    contact as contact,
    contradictions as contradictions,
    drives as drives,
    files as files,
    keys as keys,
    lips as lips,
    load as load,
    local as local,
    measures as measures,
    models as models,
    parts_as_drawn as parts_as_drawn,
    problems as problems,
    run as run,
    tables as tables,
)
