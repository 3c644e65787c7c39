"""A study to begin with, and the JSON schema by which editors complete and check studies."""

from __future__ import annotations

from typing import Any, Final

from seatfem.study.scene.schema import schema_of
from seatfem.study.scene.template import table_lines
from seatfem.study.sweep.study import Study

STUDY: Final = "study"
STUDY_SCHEMA_FILE: Final = "seatfem-study.schema.json"
_HEAD: Final = """\
# seatfem init flapper      writes the scene that stands below, unless there is one
# seatfem plan {file}     how many scenes there are, and what they would take
# seatfem sweep {file}    all of them: one table, main effects, bands; goes on where it was stopped
# A key behind a # has this default, or is absent: then the value shows how one is written (docs/studies.md).
"""
_VARY: Final = """\
[vary]
# Any keys of the scene, each with a list, a range or a distribution.
reed.thickness = { kind = "normal", mean = "0.3 mm", deviation = "0.005 mm" }
# reed.damping_ratio = [0.01, 0.02]
# contact.gap = { from = "0 mm", to = "0.1 mm" }

[outputs]
measures = ["impulse_Ns", "filtered_peak_force_N"]                       # keys of summary.json
# pareto = ["peak_reed_stress_Pa", "max impulse_Ns"]                     # two of which less, or more, is better

# In place of a design, which must go then: the best of all values between bounds, by seatfem optimise {file}
# [optimise]
# minimise = "peak_reed_stress_Pa"                                       # or maximise
# subject_to = ["impulse_Ns >= 1e-4"]                                    # in SI units
# most = 40                                                              # scenes of the search
# coarse = "20 %"                                                        # accuracy.target of the search
"""


def study_template(*, file: str, scene: str = "flapper.toml") -> str:
    """Return the text of a study of ``scene``, every key with its meaning; ``file``: what the comments call it."""
    values = {"scene": scene, "design": "latin_hypercube", "number": 32}
    keys = table_lines(Study, values, leave=("vary", "outputs", "optimise"))
    return "\n".join([_HEAD.replace("{file}", file), *keys, "", _VARY.replace("{file}", file)])


def study_schema() -> dict[str, Any]:
    """Return the schema of a study file, JSON Schema draft 2020-12; keys of [vary] may be dotted or tables."""
    schema = schema_of(Study, "seatfem study")
    values = schema["properties"]["vary"]["additionalProperties"]
    keys = {"additionalProperties": {"anyOf": [values, {"$ref": "#/$defs/Vary"}]}}
    no_distribution = {"properties": {"kind": {"not": {"type": "string"}}}}
    schema["$defs"]["Vary"] = {"type": "object", **keys, "allOf": [no_distribution]}
    schema["properties"]["vary"] = {"$ref": "#/$defs/Vary"}
    return schema
