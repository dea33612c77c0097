"""Parts of a mesh: each with its own law and reflection coefficient, one object for everyone else."""

import numpy as np
import pytest
from pydantic import ValidationError

from insonify.scene.seabed import Seabed
from insonify.scene.solid import world_triangles
from insonify.scene.target import Mesh, key_label, solids_of_one_law
from insonify.simulator import labels, simulate
from oracles.scenes import nominal
from oracles.traced import apart_db, curves, scene

trimesh = pytest.importorskip("trimesh", reason="meshes from files need the extra `targets`")
SILENT, STRONG, WEAK = ({"law": "lambert", "strength_db": level} for level in (-400, -8, -20))
HULL, TOWER = ((4.0, 2.0, 0.6), (0.0, 0.0, 0.3)), ((1.0, 0.8, 1.0), (0.9, 0.3, 1.1))
"""Sizes and centres of two blocks, one on the other [m]."""
SMALL = ((2.0, 1.0, 0.6), (0.0, 0.0, 0.3)), ((0.5, 0.4, 0.6), (0.45, 0.15, 0.9))
"""Two blocks with fewer facets [m]."""
WINDOW = {"track": {"window": (0.078, 0.086)}, "seabed": {"scattering": None}}


def block(size, centre):
    """A block as vertices and triangles, a little skewed so that no two sides have one length."""
    made = trimesh.creation.box(size)
    return np.asarray(made.vertices) + centre + 0.005 * np.sin(np.arange(24)).reshape(8, 3), np.asarray(made.faces)


def written(path, *, blocks=(HULL, TOWER), groups=("hull", "tower"), materials=(None, None)):
    """OBJ file of blocks, each a group and a material."""
    lines, count = ["mtllib none.mtl"], 0
    for (size, centre), group, material in zip(blocks, groups, materials, strict=False):
        vertices, faces = block(size, centre)
        lines += [f"g {group}"] * (group is not None) + [f"usemtl {material}"] * (material is not None)
        lines += [f"v {x:.17g} {y:.17g} {z:.17g}" for x, y, z in vertices]
        lines += [f"f {a} {b} {c}" for a, b, c in faces + count + 1]
        count += len(vertices)
    path.write_text("\n".join(lines) + "\n")
    return str(path)


def glb(path):
    """GLB file of the two blocks as nodes, y up, the tower of a material."""
    made = trimesh.Scene()
    for name, one in (("hull", HULL), ("tower", TOWER)):
        vertices, faces = block(*one)
        mesh = trimesh.Trimesh(vertices[:, [1, 2, 0]], faces, process=False)
        material = trimesh.visual.material.PBRMaterial(name=f"{name} paint")
        mesh.visual = trimesh.visual.TextureVisuals(material=material)
        made.add_geometry(mesh, node_name=name, geom_name=name)
    path.write_bytes(made.export(file_type="glb"))
    return str(path)


def vessel(file, *parts, **more):
    """The vessel 60 m to the east, askew."""
    return {"shape": "mesh", "label": "vessel", "file": file, "position": (0.0, 60.0), "heading": 0.4,
            "parts": [*parts], **more}  # fmt: skip


@pytest.mark.parametrize(("field", "law"), [("coherent", "rough"), ("coherent", "smooth"), ("incoherent", "rough")])
def test_the_echo_of_two_parts_is_the_sum_of_the_parts(tmp_path, field, law):
    """Each part with its own law, the other silent but in the way: pressures, or energies of rough parts, add.

    Within 1e-5 of the largest sample: parts of smooth facets cancel in single precision.
    """
    file, sums = written(tmp_path / "vessel.obj", blocks=SMALL), []
    name = "pressure" if field == "coherent" else "intensity"
    changes = (
        ({"scattering": WEAK}, {"scattering": STRONG})
        if law == "rough"
        else ({"face_reflection_coefficient": 0.9}, {"face_reflection_coefficient": -0.5})
    )
    for chosen in ((0, 1), (0,), (1,)):
        parts = [{"name": part, "scattering": SILENT, **(changes[row] if row in chosen else {})}
                 for row, part in enumerate(("hull", "tower"))]  # fmt: skip
        paths = {"max_reflections": 0 if law == "smooth" else 2}  # facets are many
        sums.append(simulate(nominal(targets=[vessel(file, *parts)], field=field, paths=paths, **WINDOW))[name].values)
    whole, one, other = sums
    assert min(np.abs(one).max(), np.abs(other).max()) > 1e-3 * np.abs(whole).max() > 0
    np.testing.assert_allclose(whole, one + other, atol=1e-5 * np.abs(whole).max())


@pytest.mark.parametrize("field", ["coherent", "incoherent"])
def test_smooth_parts_interfere_as_one_body(tmp_path, field):
    """Parts of one coefficient are the mesh without parts, in expected intensity too: 1e-3 of the largest sample.

    Faces are divided for the distance of each part.
    """
    file = written(tmp_path / "vessel.obj", blocks=SMALL)
    own = {"scattering": SILENT, "face_reflection_coefficient": 0.9}
    parts = [{"name": name, **own} for name in ("hull", "tower")]
    name = "pressure" if field == "coherent" else "intensity"
    found, whole = (simulate(nominal(targets=[one], field=field, paths={"max_reflections": 0}, **WINDOW))[name].values
                    for one in (vessel(file, *parts), vessel(file, **own)))  # fmt: skip
    np.testing.assert_allclose(found, whole, atol=1e-3 * np.abs(whole).max())


def test_two_parts_are_two_meshes_of_one_law_that_hide_each_other(tmp_path):
    """Expected intensity of one file in two parts and of two files, one on the other: 1e-6 of the largest sample."""
    parts = [{"name": "hull", "scattering": STRONG}, {"name": "tower", "scattering": WEAK}]
    turn, apart = np.array([[np.cos(0.4), np.sin(0.4)], [-np.sin(0.4), np.cos(0.4)]]), []
    every = np.concatenate([block(*one)[0] for one in (HULL, TOWER)])
    for name, one, law in (("hull", HULL, STRONG), ("tower", TOWER, WEAK)):
        own = block(*one)[0]
        forward, port, _ = (own.min(axis=0) + own.max(axis=0) - every.min(axis=0) - every.max(axis=0)) / 2
        north, east = np.array([forward, -port]) @ turn
        file = written(tmp_path / f"{name}.obj", blocks=(one,))
        apart.append({"shape": "mesh", "label": name, "file": file, "position": (north, 60.0 + east), "heading": 0.4,
                      "scattering": law, "base_depth": 20.0 + every[:, 2].min() - own[:, 2].min()})  # fmt: skip
    found, expected = (
        simulate(nominal(targets=targets, field="incoherent", **WINDOW))["intensity"].values
        for targets in ([vessel(written(tmp_path / "both.obj"), *parts)], apart)
    )
    np.testing.assert_allclose(found, expected, atol=1e-6 * expected.max())


def test_parts_are_one_object_in_labels(tmp_path):
    """One name of an object; parts of one law have the mask of the mesh without parts, but for 10 % of the samples."""
    file = written(tmp_path / "vessel.obj")
    parts = [{"name": "tower"}]
    found, plain = (labels(nominal(targets=[vessel(file, *some)], field="incoherent", track=WINDOW["track"]))
                    for some in (parts, []))  # fmt: skip
    assert list(found["object"].values) == list(plain["object"].values)
    assert np.mean(found["highlight"].values == plain["highlight"].values) >= 0.9


@pytest.mark.parametrize("kind", ["group", "material", "node", "paint"])
def test_parts_are_named_by_group_or_material(tmp_path, kind):
    """In OBJ and GLB: the triangles of a name are those of its block, and the others keep the law of the body."""
    if kind in ("group", "material"):
        names = ("hull", "tower")
        columns = {"groups": names} if kind == "group" else {"groups": (None, None), "materials": names}
        file, name = written(tmp_path / "vessel.obj", **columns), "tower"
    else:
        file, name = glb(tmp_path / "vessel.glb"), "tower" if kind == "node" else "tower paint"
    mesh = Mesh(**{**vessel(file, {"name": name, "scattering": STRONG}), "heading": 0.0})
    rest, tower = solids_of_one_law(mesh)
    assert (rest.scattering, tower.scattering.strength_db) == (mesh.scattering, -8)
    assert key_label(rest) == "vessel" != key_label(tower)
    seabed = Seabed(depth=20.0)
    surface, whole = world_triangles(tower, seabed), world_triangles(mesh, seabed)
    np.testing.assert_allclose(surface.high - surface.low, TOWER[0], atol=0.02)
    assert surface.high[2] == pytest.approx(20.0 - 0.6, abs=0.02)
    assert len(surface.faces) == 12 and len(whole.faces) == 24


def test_the_tracer_has_parts_too(tmp_path):
    """A wall whose near face is one part, in both engines: target within 0.05 dB."""
    file = written(tmp_path / "vessel.obj")
    target = vessel(file, {"name": "hull", "scattering": WEAK}, {"name": "tower", "scattering": STRONG})
    paths = {"families": ["D"], "max_reflections": 0, "contributions": ("target",)}
    found, traced = (
        curves(scene(engine, targets=[target], window=(0.078, 0.086), paths=paths, rays=200_000))["target", "D-D"]
        for engine in ("eigenrays", "tracer")
    )
    assert apart_db(found, traced) == pytest.approx(0, abs=0.05)


def test_a_name_that_the_file_has_not_is_refused(tmp_path):
    """The message lists the names; of an STL file there are none."""
    file = written(tmp_path / "vessel.obj", materials=("steel", "rubber"))
    with pytest.raises(
        ValidationError, match=r"no group, object or material 'mast'; it has hull, rubber, steel, tower"
    ):
        Mesh(**vessel(file, {"name": "hull"}, {"name": "mast"}))
    trimesh.Trimesh(*block(*HULL), process=False).export(tmp_path / "plain.stl")
    with pytest.raises(ValidationError, match=r"'mast'; it has none at all"):
        Mesh(**vessel(str(tmp_path / "plain.stl"), {"name": "mast"}))
