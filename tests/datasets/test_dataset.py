"""Data sets: the same whatever the parts and kills, twins that differ in one thing, annotations, a card."""

import contextlib
import errno
import gc
import io
import json
import os
import re
import subprocess
import sys
import threading
import warnings
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

import insonify
from datasets.small_dataset import write_small
from insonify.cli import main
from insonify.datasets.dataset import load_dataset, make_dataset
from insonify.datasets.dataset_folder import DatasetFolder
from insonify.datasets.drawn_scene import SceneDraws
from insonify.diagnostics.diagnostic import ScenarioError
from insonify.formats.store_description import StoreError
from insonify.part import Part
from insonify.validity import PhysicsWarning

EVERYTHING = ("write: [coco]", "write: [coco, yolo, png, zarr]")


def contents(folder: Path) -> dict[str, bytes]:
    """All files of a folder."""
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


@pytest.fixture(scope="module")
def serial(tmp_path_factory):
    """The data set made at once, and its file."""
    folder = tmp_path_factory.mktemp("serial")
    path = write_small(folder, EVERYTHING)
    assert make_dataset(path, folder / "out", processes=1)
    return path, folder / "out"


def test_parts_in_any_order_make_the_same_files(serial, tmp_path):
    """Byte by byte, card and annotations too; a part made twice, and a file left by a kill, do no harm."""
    path, whole = serial
    out = tmp_path / "out"
    assert not make_dataset(path, out, part=Part(3, 3), processes=1)
    (out / "scenes" / "00003.json").unlink(missing_ok=True)  # as killed before its note
    assert not make_dataset(path, out, part=Part(1, 3), processes=1)
    assert not make_dataset(path, out, part=Part(1, 3), processes=1)
    assert not make_dataset(path, out, part=Part(2, 3), processes=1)
    assert make_dataset(path, out, part=Part(3, 3), processes=1)
    assert contents(out) == contents(whole)


JOBS = """
import os, signal, sys, time, traceback, warnings
from pathlib import Path
import insonify.datasets.dataset
from insonify.cli import main

def job():
    number = os.fork()
    if number:
        return number
    try:
        os._exit(main(["dataset", sys.argv[1], "-o", str(out), "--quiet", "--processes", "1"]))
    except BaseException:
        traceback.print_exc()
    os._exit(1)

warnings.simplefilter("ignore")
out, end = Path(sys.argv[2]), time.monotonic() + 120
first = job()
while time.monotonic() < end and not list(out.glob("scenes/*.json")):
    time.sleep(0.005)
os.kill(first, signal.SIGKILL)
os.waitpid(first, 0)
made = len(list(out.glob("scenes/*.json")))
ends = [os.waitpid(number, 0)[1] for number in [job(), job()]]
print(made, *ends)
"""
"""One job that is killed, then two at once: forked, so that packages are loaded once."""


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(os, "fork"), reason="processes are forked")
def test_killed_jobs_resume(serial, tmp_path):
    """Killed as soon as a scene appears, and finished by two jobs at once: the same files."""
    path, whole = serial
    out = tmp_path / "out"
    command = [sys.executable, "-c", JOBS, str(path), str(out)]
    ended = subprocess.run(command, check=True, timeout=400, stdout=subprocess.PIPE, text=True).stdout
    made, *ends = map(int, ended.splitlines()[-1].split())
    assert 1 <= made <= 4 and ends == [0, 0]
    left = {name: text for name, text in contents(out).items() if not name.startswith(".")}
    assert left == contents(whole)


@pytest.mark.slow
def test_a_cluster_makes_the_same_files(serial, tmp_path, monkeypatch):
    """Byte by byte, on two workers of which one is killed within its part; scenes that are there are kept."""
    pytest.importorskip("distributed")
    path, whole = serial
    out, reports = tmp_path / "out", []
    make_dataset(path, out, part=Part(4, 4), processes=1)
    before = (out / "scenes" / "00003.json").stat().st_mtime_ns

    def part_of_a_killed_worker(folder, scenes):
        import importlib
        import os
        import signal

        make_part = importlib.import_module("insonify.datasets.dataset")._make_part
        killed = folder.path.parent / "killed"
        if scenes[0] == 0 and not killed.exists():
            make_part(folder, scenes[:1])
            killed.touch()
            os.kill(os.getpid(), signal.SIGKILL)
        return make_part(folder, scenes)

    monkeypatch.setattr(sys.modules[make_dataset.__module__], "_make_part", part_of_a_killed_worker)
    assert make_dataset(path, out, cluster="local:2", on_scene=lambda *numbers: reports.append(numbers))
    assert contents(out) == contents(whole) and (tmp_path / "killed").exists()
    assert (out / "scenes" / "00003.json").stat().st_mtime_ns == before
    assert reports[0] == (1, 4) and reports[-1] == (4, 4) and reports == sorted(reports) and len(reports) > 2


@pytest.mark.slow
def test_a_cluster_reports_what_processes_do(tmp_path, monkeypatch, capsys):
    """Warnings with the number of the scene, and values that contradict each other with file, line and image."""
    distributed = pytest.importorskip("distributed")
    monkeypatch.setattr("insonify.datasets.dataset_checks.SCENES_CHECKED", 0)
    threshold = gc.get_threshold()
    settings = {"processes": False, "protocol": "tcp", "dashboard_address": None, "memory_limit": 0}
    with distributed.LocalCluster(n_workers=1, threads_per_worker=1, **settings) as running:
        position = "{uniform_in: {area: swath, along: [0.3, 0.7], across: [9 m, 13 m]}}"
        one = ("images: 4", "images: 1"), (", split: {train: 0.5, val: 0.5}", "")
        away = write_small(tmp_path, *one, (position, "{choice: [[1 m, 300 m]]}"))
        with pytest.warns(PhysicsWarning, match=r"^scene 0: target pipe: it lies 2\d\d"):
            make_dataset(away, tmp_path / "out", cluster=running.scheduler_address)
        heading = "targets[pipe].heading: {uniform: [0 deg, 360 deg]}"
        path = write_small(tmp_path, (heading, "seabed.depth: {choice: [9 m]}"))
        options = ["-o", str(tmp_path / "none"), "--quiet", "--cluster", running.scheduler_address]
        assert main(["dataset", str(path), *options]) == 2
    gc.set_threshold(*threshold)
    assert "dataset.yaml:4: track.start: image 0: ping 0" in capsys.readouterr().err


@pytest.mark.parametrize("option", [("--part", "1/2"), ("--processes", "2"), ("--preview", "2")])
def test_a_cluster_has_no_use_for_what_is_for_one_process(serial, tmp_path, capsys, option):
    """Refused by the command, and in Python; as is an address of no cluster."""
    pytest.importorskip("distributed")
    command = ["dataset", str(serial[0]), "-o", str(tmp_path / "out"), "--cluster"]
    assert main([*command, "local:2", *option]) == 2
    assert f"{' '.join(option)}: for one process" in capsys.readouterr().err
    assert main([*command, "local"]) == 2
    assert "--cluster local is no address of a cluster" in capsys.readouterr().err
    with pytest.raises(ValueError, match="part and processes are for one process"):
        make_dataset(serial[0], tmp_path / "out", cluster="local:2", processes=2)
    assert not (tmp_path / "out").exists()


def test_another_data_set_is_not_mixed_in(serial, tmp_path):
    """A folder keeps to the data set that it was begun with, and to no other files."""
    _, whole = serial
    with pytest.raises(StoreError, match="another data set"):
        make_dataset(write_small(tmp_path, EVERYTHING, ("seed: 7", "seed: 8")), whole)
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "thesis.tex").write_text("")
    with pytest.raises(StoreError, match="no data set"):
        make_dataset(tmp_path / "dataset.yaml", tmp_path / "full")


def test_a_changed_data_set_names_the_values_that_differ(tmp_path, capsys):
    """File, line, key, value and the one that the folder was begun with: of the data set and of its scenario."""
    path, out = write_small(tmp_path), tmp_path / "out"
    make_dataset(path, out, part=Part(1, 4), processes=1)
    before = contents(out)
    edits = ("360 deg", "180 deg"), ("write: [coco]", "write: [coco]\ncompare: null")
    write_small(tmp_path, *edits, scene=(("cutoff_wavelength: 20 cm", "cutoff_wavelength: 30 cm"),))
    assert main(["dataset", str(path), "-o", str(out), "--processes", "1", "--quiet"]) == 2
    error = capsys.readouterr().err
    assert "dataset.yaml:6: vary.targets[pipe].heading.uniform.1: 180 deg; it was 360 deg in the folder.\n" in error
    assert "scene.yaml:5: seabed.cutoff_wavelength: 30 cm; it was 20 cm in the folder.\n" in error
    assert len(error.splitlines()) == 3 and "compare" not in error
    assert contents(out) == before
    write_small(tmp_path, scene=(("  cutoff_wavelength: 20 cm\n", ""),))
    assert main(["dataset", str(path), "-o", str(out), "--processes", "1", "--quiet"]) == 2
    assert "scene.yaml:2: seabed.cutoff_wavelength: not given; it was 20 cm in the folder." in capsys.readouterr().err
    (out / "dataset.json").write_text("[1")
    assert main(["dataset", str(path), "-o", str(out), "--processes", "1", "--quiet"]) == 2
    assert "dataset.json is damaged" in capsys.readouterr().err


def test_jobs_that_begin_together_share_an_empty_folder(serial, tmp_path):
    """A description that another job writes at that moment, or was stopped at, is not a foreign file."""
    described = load_dataset(serial[0])
    for n in range(30):
        together = threading.Barrier(6)

        def begin(out=tmp_path / str(n), together=together):
            folder = DatasetFolder(out, described.file, described.base)
            together.wait()
            folder.open()
            return folder.missing(range(4))

        with ThreadPoolExecutor(6) as pool:
            assert [job.result() for job in [pool.submit(begin) for _ in range(6)]] == [[0, 1, 2, 3]] * 6
    (tmp_path / "stopped").mkdir()
    (tmp_path / "stopped" / ".dataset.json.0123.partial").write_text("{")
    DatasetFolder(tmp_path / "stopped", described.file, described.base).open()


def test_values_that_contradict_each_other_are_named_by_any_process(tmp_path, monkeypatch, capsys):
    """The error of another process has file, line, image and remedy; here of a check that overlooked it."""
    monkeypatch.setattr("insonify.datasets.dataset_checks.SCENES_CHECKED", 0)
    path = write_small(
        tmp_path, ("targets[pipe].heading: {uniform: [0 deg, 360 deg]}", "seabed.depth: {choice: [9 m]}")
    )
    assert main(["dataset", str(path), "-o", str(tmp_path / "out"), "--processes", "2", "--quiet"]) == 2
    assert "dataset.yaml:4: track.start: image 0: ping 0" in capsys.readouterr().err
    with pytest.raises(ScenarioError, match="image 0"):
        next(insonify.dataset(path))


def test_a_recording_to_compare_with_is_missed_before_any_image(tmp_path):
    """Not after the last one."""
    path = write_small(tmp_path, ("write: [coco]", "compare: absent.zarr"))
    with pytest.raises(StoreError, match=r"absent\.zarr"):
        make_dataset(path, tmp_path / "out", processes=1)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("number", [errno.EROFS, errno.EACCES, errno.ENOENT, errno.ENOTDIR, errno.EIO])
@pytest.mark.parametrize("place", ["open", "write", "finish"])
def test_folders_that_cannot_be_written_are_named(serial, tmp_path, monkeypatch, number, place):
    """Whatever the system denies, and when."""
    described = load_dataset(serial[0])
    folder = DatasetFolder(tmp_path / "out", described.file, described.base)

    def denied(*_):
        raise OSError(number, os.strerror(number))

    if place != "open":
        folder.open()
        for scene in range(4):
            folder.note(scene).write_text("{}")
    step = "DatasetFolder._write_image" if place == "write" else "write_whole"
    monkeypatch.setattr(f"insonify.datasets.dataset_folder.{step}", denied)
    monkeypatch.setattr("insonify.datasets.dataset_folder.DatasetFolder.notes", denied)
    call = {"open": folder.open, "finish": folder.finish, "write": lambda: folder.write(0, iter([None]))}[place]
    with pytest.raises(StoreError, match=r"out: .* at (its beginning|its end|scene 0); "):
        call()


def test_a_damaged_note_is_named(serial, tmp_path):
    """A note of no bytes, as a crash of the machine may leave."""
    described = load_dataset(serial[0])
    folder = DatasetFolder(tmp_path / "out", described.file, described.base)
    folder.open()
    for scene in range(4):
        folder.note(scene).touch()
    with pytest.raises(StoreError, match=r"00000.json: the note is damaged. Delete it"):
        folder.finish()


@pytest.mark.parametrize("name", ["sheet.mp3", "absent/sheet.png"])
def test_a_preview_that_cannot_be_written_is_refused_at_once(serial, tmp_path, monkeypatch, name):
    """Before an image is simulated."""
    monkeypatch.setattr("insonify.datasets.contact_sheet.write_contact_sheet", None)
    assert main(["dataset", str(serial[0]), "--preview", "2", "-o", str(tmp_path / name)]) == 2


def test_a_full_disk_is_named_and_resumed(tmp_path, monkeypatch):
    """The scene is left out whole; the same command goes on there."""
    path, out = write_small(tmp_path), tmp_path / "out"
    calls = []

    def full(source, target):
        calls.append(target)
        if len(calls) == 3:
            raise OSError(errno.ENOSPC, "No space left on device")
        os.rename(source, target)

    monkeypatch.setattr("insonify.datasets.dataset_folder.os.replace", full)
    with pytest.raises(StoreError, match=r"disk is full at scene \d+; .* goes on there"):
        make_dataset(path, out, processes=1)
    assert not list(out.glob(".*.partial"))
    assert make_dataset(path, out, processes=1)


def test_coco_against_itself_has_full_precision(serial):
    """Average precision 1 of the annotations as their own detections (pycocotools), in every part of the split."""
    from pycocotools.coco import COCO
    from pycocotools.cocoeval import COCOeval

    _, out = serial
    names = set()
    for split in ("train", "val"):
        with contextlib.redirect_stdout(io.StringIO()):
            truth = COCO(str(out / "coco" / f"annotations_{split}.json"))
            found = truth.loadRes([one | {"score": 1.0} for one in truth.dataset["annotations"]])
            verdict = COCOeval(truth, found, "segm")
            verdict.evaluate()
            verdict.accumulate()
            verdict.summarize()
        assert verdict.stats[0] == pytest.approx(1.0)
        names |= {image["file_name"] for image in truth.dataset["images"]}
        assert all((out / "coco" / image["file_name"]).is_file() for image in truth.dataset["images"])
    assert len(names) == 4


def test_the_card_counts_what_is_there(serial):
    """Counts, split, ranges and seed; the page states the same."""
    _, out = serial
    card = json.loads((out / "card.json").read_text())
    assert (card["scenes"], card["images"], card["seed"], card["split"]) == (4, 4, 7, {"train": 2, "val": 2})
    assert card["annotations"]["highlight"] == 4
    heading = card["varied"]["targets[pipe].heading"]
    assert 0 <= heading["least"] < heading["largest"] <= 2 * np.pi
    assert "seed 7" in (out / "README.md").read_text()


def test_the_iterator_has_the_images_of_the_files(serial):
    """Levels, expected levels, classes and instances as in the stores; a part has its share."""
    import xarray as xr

    path, out = serial
    items = list(insonify.dataset(path, part="2/2", threads=1))
    assert [item["name"] for item in items] == ["00002", "00003"]
    for item in items:
        (store,) = out.glob(f"zarr/*/{item['name']}.zarr")
        with xr.open_zarr(store, consolidated=False) as saved:
            for name in ("image", "expected", "classes", "instances"):
                np.testing.assert_array_equal(saved[name].values, item[name])
        assert item["targets"] == ("pipe",)
        assert item["scenario"].targets[0].heading == item["drawn"]["targets[pipe].heading"]


def test_twins_differ_only_in_what_they_state(tmp_path):
    """Other speckle: the same expected levels and masks, bit for bit; no target: the same image beyond its reach."""
    pairs = ("write: [coco]", "pairs: [no_target, other_speckle]")
    path = write_small(tmp_path, pairs, ("images: 4", "images: 1"), (", split: {train: 0.5, val: 0.5}", ""),
                       scene=(("pings: 12", "pings: 30"),))  # fmt: skip
    scene, without, other = insonify.dataset(path, threads=1)
    assert [one["twin"] for one in (scene, without, other)] == ["scene", "no_target", "other_speckle"]
    for name in ("expected", "classes", "instances"):
        np.testing.assert_array_equal(other[name], scene[name])
    difference = (other["image"] - scene["image"]).ravel()
    assert np.mean(difference != 0) > 0.99 and abs(difference.mean()) < 1
    assert not without["classes"].any() and scene["classes"].any()
    changed = (without["image"] != scene["image"]).any(axis=1)
    near = scene["classes"].any(axis=1)
    reach = np.flatnonzero(near)
    assert changed[near].any()
    assert not changed[: max(reach[0] - 13, 0)].any() and not changed[reach[-1] + 13 :].any()
    assert changed.sum() < 0.8 * changed.size


def test_no_multipath_twins_lack_the_echoes_by_way_of_the_surface(tmp_path):
    """The twin is the scene with direct paths alone: weaker in the mean, with equal masks of direct echoes at most."""
    path = write_small(
        tmp_path,
        ("write: [coco]", "pairs: [no_multipath]"),
        ("images: 4", "images: 1"),
        (", split: {train: 0.5, val: 0.5}", ""),
        scene=(("max_reflections: 0", "max_reflections: 1"),),
    )
    scene, direct = insonify.dataset(path, threads=1)
    assert direct["scenario"].paths.max_reflections == 0
    assert np.mean(direct["expected"]) < np.mean(scene["expected"])


def test_clutter_has_sizes_and_places_of_its_own(tmp_path):
    """Rocks in the proportions of the library, each another one, apart from each other and from the targets.

    The values drawn for the scenario's own target are in the scenario beside them.
    """
    clutter = (
        "clutter: [{count: {integers: [2, 5]}, target: {shape: rock, label: rock, burial: {uniform: [0, 0.5]}}, "
        "length: {power_law: {exponent: 3, within: [0.3 m, 2 m]}}, position: {area: swath, apart: 1 m}}]"
    )
    described = load_dataset(write_small(tmp_path, ("write: [coco]", clutter)))
    draws = SceneDraws(described.file, described.base)
    counts = set()
    for image in range(6):
        scenario, drawn = draws.scene(image)
        pipe, *rocks = scenario.targets
        assert pipe.heading == drawn["targets[pipe].heading"]
        assert list(pipe.position) == drawn["targets[pipe].position"] != [1, 12]
        counts.add(len(rocks))
        assert [rock.label for rock in rocks] == [f"rock {n + 1}" for n in range(len(rocks))]
        assert len({rock.variant for rock in rocks}) == len(rocks)
        assert all(0.3 <= rock.size[0] <= 2 and 0 <= rock.burial <= 0.5 for rock in rocks)
        places = np.array([target.position for target in scenario.targets])
        apart = np.linalg.norm(places[:, None] - places, axis=-1) + 10 * np.eye(len(places))
        assert apart[1:].min() >= 1
    assert counts <= {2, 3, 4, 5} and len(counts) > 1


def test_warnings_are_about_scenes_that_are_simulated(tmp_path):
    """Not about targets where the base has them, 100 m from the track of an image; and with the number of the scene."""
    elsewhere = write_small(tmp_path, ("vary:", "vary:\n  track.start[0]: {choice: [-100 m]}"))
    with warnings.catch_warnings():
        warnings.simplefilter("error", PhysicsWarning)
        described = load_dataset(elsewhere)
        SceneDraws(described.file, described.base).scene(0)
    with pytest.warns(PhysicsWarning, match="target pipe"):
        described.base.with_("track.start.0", "-100 m")
    position = "{uniform_in: {area: swath, along: [0.3, 0.7], across: [9 m, 13 m]}}"
    away = write_small(tmp_path, ("images: 4", "images: 2"), (position, "{choice: [[1 m, 300 m]]}"))
    for processes in (1, 2):
        with pytest.warns(PhysicsWarning, match=r"^scene 1: target pipe: it lies 2\d\d"):
            make_dataset(away, tmp_path / f"out{processes}", processes=processes)


def test_the_file_on_the_page_about_data_sets_is_accepted(tmp_path):
    """As it stands there, beside the scene that it names."""
    root = Path(__file__).parents[2]
    page = (root / "docs" / "explanation" / "data-sets.md").read_text(encoding="utf-8")
    (text,) = re.findall(r"```yaml\n(.*?)```", page, re.DOTALL)
    (tmp_path / "dataset.yaml").write_text(text)
    (tmp_path / "dataset-scene.yaml").write_text((root / "examples" / "dataset-scene.yaml").read_text())
    assert load_dataset(tmp_path / "dataset.yaml").file.clutter


def test_what_killed_jobs_left_is_deleted_after_a_day(serial):
    """Hidden folders of scenes, and no younger ones: another job may be writing those."""
    path, out = serial
    old, young = (out / f".00001.{name * 32}.partial" for name in "ab")
    for folder in (old, young):
        folder.mkdir()
    os.utime(old, (0, 0))
    make_dataset(path, out)
    assert not old.exists() and young.exists()
    young.rmdir()


@pytest.mark.parametrize("name", ["dataset.yaml", "forward-looking-dataset.yaml"])
def test_the_examples_are_accepted(name):
    """With their scenes, without a warning about either."""
    with warnings.catch_warnings():
        warnings.simplefilter("error", PhysicsWarning)
        assert load_dataset(Path(__file__).parents[2] / "examples" / name).base.field == "incoherent"


def test_what_starts_a_finished_data_set_anew(serial, capsys):
    """The command has no --overwrite, and names what there is."""
    path, out = serial
    assert main(["dataset", str(path), "-o", str(out)]) == 0
    message = " ".join(capsys.readouterr().err.split())
    assert f"delete {out} to start anew" in message and "--overwrite" not in message


def test_command_line(tmp_path, capsys):
    """A contact sheet, a folder that is requested, a part that there is not."""
    path = write_small(tmp_path, ("images: 4", "images: 2"))
    assert main(["dataset", str(path), "--preview", "2"]) == 0
    assert (tmp_path / "dataset-preview.png").stat().st_size > 20_000
    assert main(["dataset", str(path)]) == 2
    assert main(["dataset", str(path), "-o", str(tmp_path / "out"), "--part", "3/2"]) == 2
    assert "-o DIR is missing" in capsys.readouterr().err
