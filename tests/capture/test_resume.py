"""A capture that is gone on with ends as one that nothing has disturbed: the same files, byte by byte."""

from __future__ import annotations

import json
import logging
import shutil

import pytest

from firefly_sample.capture.journal import Journal
from firefly_sample.capture.manifest import read_manifest
from firefly_sample.cli import main
from firefly_sample.errors import FireflyError, OutputError
from firefly_sample.settings import Settings
from tests.capture.captures import GLADE, SMALL, capture, content, touched

pytestmark = pytest.mark.filterwarnings("ignore::firefly_sample.SoftwareDriverWarning")


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    """The folder of a capture of 6 frames, which nobody changes."""
    folder = tmp_path_factory.mktemp("undisturbed")
    capture(folder)
    return folder


def picture(folder, index):
    return folder / f"color_{index:06d}.png"


def remove(folder):
    picture(folder, 2).unlink()


def truncate(folder):
    path = picture(folder, 2)
    path.write_bytes(path.read_bytes()[:-9])


def empty(folder):
    picture(folder, 2).write_bytes(b"")


def swap(folder):
    one, other = picture(folder, 2).read_bytes(), picture(folder, 3).read_bytes()
    picture(folder, 2).write_bytes(other)
    picture(folder, 3).write_bytes(one)


def lose_the_manifest(folder):
    (folder / "manifest.json").unlink()


def add_strays(folder):
    for name in ("color_000077.png", "depth_000002.npz", ".color_000001.png.77-1.part"):
        (folder / name).write_bytes(b"stray")


def format_the_manifest(folder):
    path = folder / "manifest.json"
    path.write_text(json.dumps(json.loads(path.read_text()), indent=2))
    picture(folder, 4).unlink()


DAMAGES = {
    remove: [2],
    truncate: [2],
    empty: [2],
    swap: [2, 3],
    lose_the_manifest: range(6),
    add_strays: [],
    format_the_manifest: [4],
}


@pytest.mark.parametrize("damage", DAMAGES, ids=lambda damage: damage.__name__)
def test_damaged_files_are_drawn_again_and_no_others(tmp_path, undisturbed, damage):
    folder = tmp_path / "out"
    shutil.copytree(undisturbed, folder)
    damage(folder)
    before = touched(folder)
    manifest = capture(folder, resume=True)
    assert content(folder) == content(undisturbed)
    assert manifest == read_manifest(undisturbed)
    changed = {name for name, time in touched(folder).items() if before.get(name) != time}
    assert changed == {picture(folder, index).name for index in DAMAGES[damage]}


EARLIER = {
    "fewer frames": {"frames": "0:3"},
    "later frames": {"frames": "3:6"},
    "every second frame": {"frames": "1:6:2"},
    "backwards": {"frames": range(5, 1, -2)},
    "other parameters": {"parameters": {"fireflies": 3, "seed": 8}},
    "other settings": {"settings": Settings(supersample=1)},
    "another size": {"size": (9, 6)},
    "another time": {"fps": 2.0},
    "more outputs": {"outputs": ("color", "depth")},
    "another output": {"outputs": ("depth",)},
}


@pytest.mark.parametrize("earlier", EARLIER.values(), ids=EARLIER)
def test_what_was_captured_otherwise_becomes_what_is_asked_for(tmp_path, undisturbed, earlier):
    capture(tmp_path, **earlier)
    before = touched(tmp_path)
    seen = []
    capture(tmp_path, resume=True, progress=lambda *counts: seen.append(counts))
    assert content(tmp_path) == content(undisturbed)
    kept = len(before) if earlier.keys() == {"frames"} else 0
    assert seen == [(done, 6) for done in range(kept, 7)]
    assert sum(before.get(name) == time for name, time in touched(tmp_path).items()) == kept


def test_frames_that_are_not_asked_for_any_more_are_kept(tmp_path, undisturbed):
    shutil.copytree(undisturbed, tmp_path, dirs_exist_ok=True)
    picture(tmp_path, 5).unlink()
    capture(tmp_path, frames="1:2", resume=True)
    assert content(tmp_path) == content(undisturbed)


def test_an_interrupted_capture_goes_on_wherever_it_stood(tmp_path, undisturbed, caplog):
    def stop(done, total):
        if done == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        capture(tmp_path, progress=stop)
    assert caplog.messages == [f"3 of 6 frames are whole in {tmp_path}; to go on, use --resume"] or (
        caplog.messages[0][0] in "456"
    )
    assert "journal.jsonl" in content(tmp_path)
    with pytest.raises(OutputError, match=r"^there is a capture in"):
        capture(tmp_path)
    with (tmp_path / "journal.jsonl").open("ab") as file:
        file.write(b'{"index": 5, "about": "cut o')
    caplog.clear()
    with caplog.at_level(logging.INFO):
        capture(tmp_path, resume=True)
    assert " whole already" in caplog.messages[0]
    assert content(tmp_path) == content(undisturbed)


def test_resuming_in_a_new_folder_is_a_capture(tmp_path, undisturbed):
    capture(tmp_path / "new", resume=True)
    assert content(tmp_path / "new") == content(undisturbed)


def test_files_that_change_while_others_are_drawn_are_drawn_again(tmp_path, undisturbed, caplog):
    def damage(done, total):
        if done == 4 and picture(tmp_path, 0).exists():
            truncate(tmp_path)

    def change(done, total):
        picture(tmp_path, 0).unlink(missing_ok=True)

    capture(tmp_path, progress=damage)
    assert content(tmp_path) == content(undisturbed)
    assert any(
        message.startswith("files were changed while others were drawn") for message in caplog.messages
    )
    with pytest.raises(FireflyError, match=r"^files in \S+ are changed by another program all the time$"):
        capture(tmp_path, progress=change, overwrite=True)
    assert "manifest.json" not in content(tmp_path)


def test_overwriting_that_fails_or_is_killed_before_its_first_frame_keeps_the_old_capture(
    tmp_path, undisturbed, monkeypatch
):
    folder = tmp_path / "out"
    shutil.copytree(undisturbed, folder)
    with pytest.raises(FireflyError):
        capture(folder, size=(10**6, 1), overwrite=True)
    with pytest.raises(FireflyError, match="no fourth frame"), pytest.warns(UserWarning, match="cannot be"):
        capture(folder, "tests.cli.glade:failing", frames="3:5", parameters={}, overwrite=True)

    def die(*_):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr("firefly_sample.renderer.Renderer.render_many", die)
        with pytest.raises(KeyboardInterrupt):
            capture(folder, overwrite=True)
    assert content(folder) == content(undisturbed)


def test_resume_and_overwrite_exclude_each_other(tmp_path):
    with pytest.raises(OutputError, match="choose one of them"):
        capture(tmp_path, resume=True, overwrite=True)
    with pytest.raises(OutputError, match="a shard cannot overwrite"):
        capture(tmp_path, shard="1/2", overwrite=True)


def test_a_sweep_and_a_plain_capture_do_not_mix(tmp_path, undisturbed):
    folder = tmp_path / "out"
    shutil.copytree(undisturbed, folder)
    with pytest.raises(
        OutputError, match=r"there is a capture without a sweep, and --resume needs the same --sweep names"
    ):
        capture(folder, sweep={"fireflies": [1, 2]}, resume=True)
    assert content(folder) == content(undisturbed)
    capture(folder, frames="0:1", sweep={"fireflies": [1, 2]}, overwrite=True)
    assert content(folder).keys() == {
        *("fireflies=1/color_000000.png", "fireflies=2/color_000000.png", "manifest.json")
    }
    with pytest.raises(OutputError, match=r"there is a sweep over fireflies, and --resume"):
        capture(folder, resume=True)
    capture(folder, overwrite=True)
    assert content(folder) == content(undisturbed)


def test_a_journal_that_only_describes_is_no_capture(tmp_path, undisturbed):
    """A process was killed between the description of a job and its first frame."""
    asked = {"frames": (0, 6, 1), "jobs": 2, "shard": ""}
    from tests.capture.described import description_of

    with Journal(tmp_path / "journal.jsonl", 1, asked) as journal:
        journal._append({"about": "x", "is": description_of(folder="a=1", values={"a": 1})})
    capture(tmp_path)
    assert content(tmp_path) == content(undisturbed)


def test_a_measured_exposure_is_one_number_in_all_ways_of_drawing(tmp_path):
    auto = {"settings": Settings(exposure="auto"), "parameters": {"fireflies": 5, "dusk": False}}
    exposure = capture(tmp_path / "a", **auto)["exposure"]
    whole = content(tmp_path / "a")
    assert exposure not in (None, 1.0)
    capture(tmp_path / "b", **auto, frames="5")
    assert json.loads(content(tmp_path / "b")["manifest.json"])["exposure"] == exposure
    capture(tmp_path / "b", **auto, resume=True)
    assert content(tmp_path / "b") == whole
    capture(tmp_path / "c", **auto, shard="2/2")
    capture(tmp_path / "c", **auto, shard="1/2")
    assert content(tmp_path / "c") == whole
    (tmp_path / "a" / "manifest.json").unlink()
    capture(tmp_path / "a", **auto, resume=True)
    assert content(tmp_path / "a") == whole


def test_a_model_that_changed_between_runs_is_drawn_again(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    cube = "v 0 0 0\nv 1 0 0\nv 0 {height} 0\nf 1 2 3\n"
    model = tmp_path / "model.obj"
    options = {"scene": "model.obj", "frames": "0:2", "parameters": {}}
    model.write_text(cube.format(height=2))
    capture(tmp_path / "new", **options)
    model.write_text(cube.format(height=1))
    manifest = capture(tmp_path / "out", **options)
    assert list(manifest["sources"]) == ["model.obj"]
    times = touched(tmp_path / "out")
    capture(tmp_path / "out", **options, resume=True)
    assert touched(tmp_path / "out") == times
    model.write_text(cube.format(height=2))
    capture(tmp_path / "out", **options, resume=True)
    assert content(tmp_path / "out") == content(tmp_path / "new")


def test_the_scene_is_named_as_given(tmp_path, undisturbed):
    assert read_manifest(undisturbed)["scene"] == GLADE
    assert tuple(read_manifest(undisturbed)["size"]) == SMALL["size"]


def test_settings_that_were_chosen_by_measuring_are_kept(tmp_path, capsys):
    """Another measurement may choose others, and every frame would be drawn again."""
    words = ["capture", GLADE, "--size", "8x6", "--time", "0", "-o", str(tmp_path / "out")]
    assert main([*words, "--albedo-format", "rgba32f"]) == 0
    chosen = read_manifest(tmp_path / "out")["settings"]
    before = touched(tmp_path / "out")
    capsys.readouterr()
    assert main([*words, "--budget-ms", "1e6", "--frames", "0:2", "--resume"]) == 0
    kept, whole, *_ = capsys.readouterr().err.splitlines()
    assert (
        kept == f"firefly: the settings of the frames in {tmp_path / 'out'} are kept: none are chosen again"
    )
    assert whole == "firefly: 1 frame is whole already"
    assert read_manifest(tmp_path / "out")["settings"] == chosen
    assert before.items() <= touched(tmp_path / "out").items()


def test_another_scene_is_refused_and_unfinished_frames_are_named(tmp_path, caplog):
    def stop(done, total):
        if done == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        capture(tmp_path, progress=stop)
    with pytest.raises(OutputError, match=r"there is a capture of scene .*:glade', not of .*:empty': choose"):
        capture(tmp_path, "tests.cli.glade:empty", parameters={}, resume=True)
    manifest = capture(tmp_path, frames="0:1", resume=True)
    left = 6 - len(manifest["frames"])
    assert 1 <= left <= 4
    said = f"{left} frames that an earlier run was asked for are not drawn: name them in --frames"
    assert said in [record.getMessage() for record in caplog.records]


def test_files_named_like_frames_are_not_taken_for_a_capture(tmp_path):
    (tmp_path / "color_000007.png").write_bytes(b"mine")
    with pytest.raises(OutputError, match=r"named like frames, for example color_000007\.png: use another"):
        capture(tmp_path)
    assert (tmp_path / "color_000007.png").read_bytes() == b"mine"
