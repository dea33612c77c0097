"""Bodies from files: one body in four formats, its axes and units, and messages on files that hold no body."""

import sys
import warnings
from pathlib import Path

import numpy as np
import pytest
from pydantic import ValidationError

from insonify.scenario.load import parse_model
from insonify.scenario.write import to_yaml
from insonify.scene.mesh_file import edge_defects, repaired
from insonify.scene.scene import Scene
from insonify.scene.seabed import Seabed
from insonify.scene.solid import body_triangles, world_triangles
from insonify.scene.target import Mesh, Plate
from insonify.scene.triangle_surfaces import Triangles, block, sphere
from insonify.validity import PhysicsWarning

trimesh = pytest.importorskip("trimesh", reason="meshes from files need the extra `targets`")
BED = Seabed(depth=20.0)


def hull():
    """Longer than wide, wider than high, with a bow, and a keel to port: x forward, y to port, z up."""
    return np.array([[2, 0, 0.5], [-1, -0.5, 0.5], [-1, 0.5, 0.5], [-1, 0.2, -0.3]], float), np.array(
        [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]
    )


def saved(path, vertices, faces):
    """A mesh in a file of the kind that its suffix states."""
    trimesh.Trimesh(vertices, faces, process=False).export(path)
    return str(path)


@pytest.mark.parametrize("suffix", ["stl", "obj", "ply", "glb"])
def test_a_body_is_the_same_in_every_format(tmp_path, suffix):
    """Bow forward, starboard to the right, deck up, in STL, OBJ, PLY (z up) and GLB (y up by its standard)."""
    vertices, faces = hull()
    if suffix == "glb":
        vertices = vertices[:, [1, 2, 0]]  # x to port, y up, z forward: glTF 2.0
    found = body_triangles(Mesh(position=(0, 0), file=saved(tmp_path / f"hull.{suffix}", vertices, faces)))
    np.testing.assert_allclose(found.high, [1.5, 0.5, 0.4], atol=1e-6)
    bow = found.vertices[np.argmax(found.vertices[:, 0])]
    np.testing.assert_allclose(bow, [1.5, 0, -0.4], atol=1e-6)
    keel = found.vertices[np.argmax(found.vertices[:, 2])]
    np.testing.assert_allclose(keel, [-1.5, -0.2, 0.4], atol=1e-6)
    assert found.volume == pytest.approx(3 * (0.5 * 1 * 0.8) / 3, rel=1e-6)
    assert len(found.faces) == 4 and edge_defects(found.faces) == (0, 0)


def test_text_in_another_alphabet_is_read(tmp_path):
    """An OBJ file whose comment is not UTF-8, as older programs write it, is the same body."""
    file = Path(saved(tmp_path / "hull.obj", *hull()))
    plain = body_triangles(Mesh(position=(0, 0), file=str(file)))
    file.write_bytes(b"# Gr\xf6\xdfe, na\xefve\n" + file.read_bytes())
    found = body_triangles(Mesh(position=(0, 0), file=str(file)))
    np.testing.assert_allclose(found.vertices, plain.vertices)


def test_a_file_of_noise_is_refused_for_what_it_is(tmp_path):
    """Bytes without sense: not for want of some package."""
    for name in ("noise.obj", "noise.stl"):
        (tmp_path / name).write_bytes(np.random.default_rng(1).bytes(500))
        with pytest.raises(ValidationError, match="Export") as error:
            body_triangles(Mesh(position=(0, 0), file=str(tmp_path / name)))
        assert "No module" not in str(error.value)


def test_up_and_scale_state_how_a_file_was_drawn(tmp_path):
    """The same body drawn y up in millimetres, given so."""
    vertices, faces = hull()
    file = saved(tmp_path / "hull.stl", 1000 * vertices[:, [1, 2, 0]], faces)
    found = body_triangles(Mesh(position=(0, 0), file=file, up="y", scale=0.001))
    np.testing.assert_allclose(found.high, [1.5, 0.5, 0.4], atol=1e-5)


def test_a_mesh_turned_inside_out_is_turned_back(tmp_path):
    """Faces that look inwards enclose a negative volume; the body is the same."""
    vertices, faces = hull()
    right, wrong = (
        body_triangles(Mesh(position=(0, 0), file=saved(tmp_path / name, vertices, rows)))
        for name, rows in (("right.ply", faces), ("wrong.ply", faces[:, ::-1]))
    )
    assert wrong.volume == pytest.approx(right.volume) and right.volume > 0


def test_an_open_surface_scatters_on_both_sides_and_is_reported(tmp_path):
    """A box without its lid: a warning that names the file; every face is there once for each side."""
    whole = block(2, 1, 1)
    file = saved(tmp_path / "tray.stl", whole.vertices, whole.faces[:-2])
    with pytest.warns(PhysicsWarning, match=r"tray\.stl: the surface is not closed: 4 edges belong to one face only"):
        found = body_triangles(Mesh(position=(0, 0), file=file))
    assert len(found.faces) == 20 and found.volume == pytest.approx(0, abs=1e-9)


def test_faces_without_an_area_are_left_out_and_counted():
    """Two needles among twelve triangles: the body stays closed, and a remark states how many went."""
    whole = block(2, 1, 1)
    needles = np.concatenate([whole.faces, [[0, 0, 1], [2, 2, 2]]])
    found, _, remarks = repaired(Triangles(whole.vertices, needles))
    assert len(found.faces) == 12 and found.volume == pytest.approx(2)
    assert remarks == ["2 of 14 triangles have no area and are left out"]


def test_corners_at_one_place_are_one_corner():
    """As STL writes it, each face with corners of its own: closed all the same."""
    whole = sphere(2.0, steps=24)
    loose = Triangles(whole.corners.reshape(-1, 3), np.arange(3 * len(whole.faces)).reshape(-1, 3))
    assert edge_defects(loose.faces)[0] > 0
    found, _, remarks = repaired(loose)
    assert remarks == [] and edge_defects(found.faces) == (0, 0)
    assert len(found.vertices) == len(whole.vertices)


def test_faces_that_disagree_are_reported():
    """One face of a closed block the other way round: both of its sides scatter, and a remark states why."""
    whole = block(2, 1, 1)
    faces = whole.faces.copy()
    faces[3] = faces[3, ::-1]
    found, _, (remark,) = repaired(Triangles(whole.vertices, faces))
    assert len(found.faces) == 24 and "3 edges join faces that disagree" in remark


REFUSED = {
    "there.stl": (None, "file", "there is no such file"),
    "body.step": (b"ISO-10303-21;", "file", r"is not a kind of mesh that is read; export it as one of .stl"),
    "empty.stl": (b"", "file", "(holds no triangles|cannot be read as STL)"),
    "line.obj": (b"v 0 0 0\nv 1 0 0\nl 1 2\n", "file", "holds no triangles"),
    "junk.ply": (b"hello world", "file", "cannot be read as PLY"),
    "gap.obj": (b"v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "file", r"corner 0 is \[nan"),
    "flat.obj": (b"v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n", "file", "no triangle of the mesh has an area"),
    "mm.obj": (b"v 0 0 0\nv 2000 0 0\nv 0 500 0\nf 1 2 3\n", "scale", r"is 2000 m long.*write scale: 0\.001"),
    "km.obj": (b"v 0 0 0\nv .0002 0 0\nv 0 .0005 0\nf 1 2 3\n", "scale", "too small to be seen"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_a_file_that_is_no_body_is_refused_by_name_with_the_fix(tmp_path, name):
    """Missing, foreign, empty, broken or of a size that no target has: the field, the file, what to do."""
    content, field, message = REFUSED[name]
    if content is not None:
        (tmp_path / name).write_bytes(content)
    with pytest.raises(ValidationError, match=f"(?s){field}: .*{name}.*{message}") as caught:
        Scene(targets=[{"shape": "mesh", "position": (0, 0), "file": str(tmp_path / name)}])
    assert len(caught.value.errors()) == 1


def test_a_sheet_that_lies_flat_has_no_height(tmp_path):
    """What would be buried by nothing at all is reported to be flat, not to want a burial below 0 m."""
    file = saved(
        tmp_path / "sheet.ply", np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]), np.array([[0, 1, 2], [0, 2, 1]])
    )
    with pytest.raises(ValidationError, match=r"has no height as it lies: it is flat"):
        Scene(seabed=BED, targets=[{"shape": "mesh", "position": (0, 0), "file": file}])


def test_a_doubtful_size_is_a_warning(tmp_path):
    """Half a kilometre and two centimetres are sizes that few targets have; neither is refused."""
    vertices, faces = hull()
    for factor, word in ((150.0, "millimetres"), (0.006, "larger scale")):
        file = saved(tmp_path / f"{word[:3]}.ply", vertices * factor, faces)
        with pytest.warns(PhysicsWarning, match=word):
            Mesh(position=(0, 0), file=file)


def test_without_trimesh_the_message_states_what_to_install(tmp_path, monkeypatch):
    """The extra is named; scenarios without mesh files never request it."""
    file = saved(tmp_path / "alone.stl", *hull())
    monkeypatch.setitem(sys.modules, "trimesh", None)
    with pytest.raises(ValidationError, match=r"pip install .*(\[targets\]|trimesh)"):
        Mesh(position=(0, 0), file=file)
    Plate(position=(0, 0), length=1, width=1)


def test_a_file_keeps_its_fingerprint(tmp_path):
    """Written out, a scene names the file's digest; read back over another content it is refused, over the same not."""
    vertices, faces = hull()
    file = saved(tmp_path / "hull.ply", vertices, faces)
    scene = Scene(targets=[{"shape": "mesh", "position": (0, 0), "file": file}])
    text = to_yaml(scene)
    assert parse_model(Scene, text) == scene and len(scene.targets[0].sha256) == 64
    saved(tmp_path / "hull.ply", vertices * 2, faces)
    with pytest.raises(ValueError, match=r"targets\.0\.sha256 \(mesh\): .* the file has changed since"):
        parse_model(Scene, text)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        again = Scene(targets=[{"shape": "mesh", "position": (0, 0), "file": file}])
    assert world_triangles(again.solids[0], BED).volume == pytest.approx(8 * 0.4, rel=1e-6)


def test_a_file_stands_beside_its_scenario(tmp_path):
    """A relative path starts at the folder of the scenario."""
    saved(tmp_path / "hull.ply", *hull())
    text = "targets:\n  - {shape: mesh, position: [0, 5], file: hull.ply}\n"
    (mesh,) = parse_model(Scene, text, folder=tmp_path).targets
    assert mesh.file == str(tmp_path / "hull.ply")
