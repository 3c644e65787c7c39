"""Contact laws in scenes: what they become, and that a run obeys them."""

import math

import numpy as np
import pytest

import impact
from tests.gallery import load_text
from tests.steps import SceneError, run_contacts, striker_of

SCENE = (
    '[seat]\nkind = "spring"\nstiffness = "1e15 N/m"\n[reed]\nkind = "rigid_mass"\nmass = "5 g"\nvelocity = "-2 m/s"\n'
    '{law}\n[run]\nduration = "1 ms"\n'
)
SEAT = impact.spring(stiffness=1e15)


def scene_with(law, folder):
    return load_text(folder, SCENE.format(law=law))


@pytest.mark.parametrize(
    ("law", "expected"),
    [
        ("", impact.Signorini()),
        ('[contact]\nlaw = "signorini"', impact.Signorini()),
        ('[contact]\nlaw = { kind = "signorini" }', impact.Signorini()),
        ('[contact]\nlaw = { kind = "spring", stiffness = "20 N/um" }', impact.LinearSpring(20e6)),
        ('[contact]\nlaw = { kind = "hertz", stiffness = "5 GN/m^1.5" }', impact.Hertz(5e9)),
        ('[contact.law]\nkind = "hunt_crossley"\nstiffness = "1 N/mm^1.5"\ndamping = "0.2 s/m"',
         impact.HuntCrossley(1e3**1.5, 0.2)),
        ('[contact]\nlaw = { kind = "rough_joint", force = "8 kN", closure = "2 um" }',
         impact.RoughJoint.through(force=8e3, closure=2e-6)),
        ('[contact.law]\nkind = "rough_joint"\nforce = "8 kN"\nclosure = "2 um"\nexponent = 3\nrecovery = 0.4',
         impact.RoughJoint.through(force=8e3, closure=2e-6, exponent=3.0, recovery=0.4)),
    ],
)  # fmt: skip
def test_a_scenes_law(law, expected, tmp_path):
    assert scene_with(law, tmp_path).contact.law.law() == expected


@pytest.mark.parametrize(
    ("law", "words"),
    [
        ('law = "hertz"', "contact.law.stiffness: required"),
        ('law = { kind = "hertz", stiffness = "5 N/m" }', "contact.law.stiffness: '5 N/m'"),
        ('law = { kind = "spring", stiffness = "-5 N/m" }', "contact.law.stiffness: '-5 N/m'"),
        ('law = { kind = "spring", k = "5 N/m", stiffness = "5 N/m" }', "contact.law.k: unknown key"),
        ("law = 3", "contact.law"),
        ('law = { kind = "rough_joint", force = "8 kN", closure = "2 um", recovery = 1.1 }',
         "contact.law.recovery: 1.1"),
        ('law = { kind = "rough_joint", force = "8 kN" }', "contact.law.closure: required"),
        ('law = { kind = "table_joint", file = "none.csv" }', "contact.law.file"),
        (
            'law = { kind = "rough_joint", force = "8 kN", closure = "2 um" }\n'
            'film = { viscosity = "18 uPa s", floor = "2 um", width = "1 mm", length = "9 mm" }',
            "contact.film:.*fluid",
        ),
    ],
)  # fmt: skip
def test_what_is_wrong_is_named(law, words, tmp_path):
    with pytest.raises(SceneError, match=words):
        scene_with(f"[contact]\n{law}", tmp_path)


TABLE = "closure [um],loading [kN],unloading [kN]\n1,2,0\n2,8,0\n3,18,18\n"


def test_a_joint_is_read_from_its_table(tmp_path):
    (tmp_path / "joint.csv").write_text(TABLE)
    law = scene_with('[contact]\nlaw = { kind = "table_joint", file = "joint.csv" }', tmp_path).contact.law
    np.testing.assert_allclose(law.law(0.5).closures, (1e-6, 2e-6, 3e-6), rtol=1e-14)
    assert law.law(0.5).loading == (1e3, 4e3, 9e3)
    assert law.law(0.5).unloading == (0.0, 0.0, 9e3)


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        (("unloading [kN]", "unloading"), "column 'unloading'"),
        (("2,8,0", "2,8,9"), "softer|closure"),
        (("3,18,18", "3,18,17"), "one force in both columns"),
    ],
)
def test_a_table_that_is_no_joint_is_refused_with_its_key(wrong, words, tmp_path):
    (tmp_path / "joint.csv").write_text(TABLE.replace(*wrong))
    with pytest.raises(SceneError, match=rf"contact.law.file: .*({words})"):
        scene_with('[contact]\nlaw = { kind = "table_joint", file = "joint.csv" }', tmp_path)


def test_a_run_obeys_the_law(tmp_path):
    """A mass on a stiff seat has Hertz's duration 2.94 d/v and largest force, and the spring's v sqrt(k m)."""
    mass, speed, k = 5e-3, 2.0, 5e9
    scene = scene_with('[contact]\nlaw = { kind = "hertz", stiffness = "5 GN/m^1.5" }', tmp_path)
    result = run_contacts(scene, striker_of(scene), SEAT, 2e-8).seat
    depth = (1.25 * mass * speed**2 / k) ** 0.4
    # passive steps of 2e-8 s in a blow of some 3e-5 s: each end of the blow is known to a step, the force to 1e-3
    assert impact.measures.peak_force(result) == pytest.approx(k * depth**1.5, rel=3e-3)
    start, end = impact.measures.contact_groups(result)[0]
    assert end - start == pytest.approx(2.9432751 * depth / speed, rel=5e-3)
    soft = scene_with('[contact]\nlaw = { kind = "spring", stiffness = "20 N/um" }', tmp_path)
    result = run_contacts(soft, striker_of(soft), SEAT, 2e-8).seat
    assert impact.measures.peak_force(result) == pytest.approx(speed * math.sqrt(20e6 * mass), rel=3e-3)
