"""Folders of captures that died: what may be in them, and what must be in them after ``--resume``."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Callable, Iterable
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

from firefly_sample.capture.datasets import DATASETS
from firefly_sample.capture.layout import layout_of
from tests.capture.launch import Launcher, Run

ROLLING = ("tests.capture.scenes:rolling", "--size", "16x12", "--frames", "0:8", "--outputs", "color,depth")
GLADE = ("tests.cli.glade:glade", "--size", "16x12", "--frames", "0:24", "--outputs", "color,depth,id")
BOP = (
    *("tests.capture.scenes:parade", "--size", "16x12", "--frames", "0:4", "--fps", "1", "--time", "0"),
    *("--views", "orbit:3", "--dataset", "bop"),
)
OTHER = ("--time", "77")
"""An option with which every picture is another."""
_AUXILIARY = re.compile(
    r"\.firefly(-\d+-of-\d+)?\.lock|journal(-\d+-of-\d+)?\.jsonl|manifest\.previous\.json"
)
_PART = re.compile(r"\..+\.part")


class Death(NamedTuple):
    """What a death left: whole frames, and files with temporary names."""

    whole: int
    parts: int


class Stage:
    """Where captures with the same words die and are resumed.

    Parameters
    ----------
    launcher : Launcher
    folder : Path
        For the folders of captures.
    words : iterable of str
        The scene and the options of all captures.
    dataset : str, optional
        The data set that they are.

    Attributes
    ----------
    deaths : list of Death
        Those that were checked by `check_dead`.
    """

    def __init__(
        self, launcher: Launcher, folder: Path, words: Iterable[str], dataset: str | None = None
    ) -> None:
        self.launcher, self._folder = launcher, folder
        self.words = tuple(words)
        self.named = layout_of(dataset).parse
        self._documents = DATASETS[dataset].documents if dataset is not None else ()
        self._made = 0
        self.deaths: list[Death] = []

    def new(self, name: str = "capture") -> Path:
        """A folder that does not exist yet."""
        self._made += 1
        return self._folder / f"{name}-{self._made}"

    def start(self, *words: object, **options: Any) -> Run:
        """Start a capture; the last word is its folder. See `Launcher.start`."""
        return self.launcher.start(*self.words, *words, **options)

    def start_command(self, *words: object) -> Run:
        """Start a capture from its first moment on; the last word is its folder."""
        return self.launcher.start_command(*self.words, *words)

    @cached_property
    def undisturbed(self) -> dict[str, bytes]:
        """The files of a capture that nothing happened to."""
        return self._captured()

    @cached_property
    def other(self) -> dict[str, bytes]:
        """The files of a capture with other settings."""
        return self._captured(*OTHER)

    @cached_property
    def operations(self) -> list[str]:
        """The file operations of a capture that nothing happened to."""
        log = self._folder / "operations"
        self.start(self.new("logged"), log=log).end()
        return log.read_text().splitlines()

    def _captured(self, *more: str) -> dict[str, bytes]:
        folder = self.new("undisturbed")
        self.start(*more, folder).end()
        files = contents(folder)
        described = {"manifest.json", *self._documents}
        assert described <= files.keys()
        assert all(self.named(name) or name in described for name in files), files.keys()
        return files

    @property
    def frames(self) -> dict[int, list[str]]:
        """The files of each frame."""
        frames: dict[int, list[str]] = {}
        for name in self.undisturbed:
            if named := self.named(name):
                frames.setdefault(named[1], []).append(name)
        return frames

    def put(self, files: dict[str, bytes]) -> Path:
        """A new folder with these files."""
        folder = self.new()
        folder.mkdir()
        for name, content in files.items():
            (folder / name).parent.mkdir(exist_ok=True)
            (folder / name).write_bytes(content)
        return folder

    def count(self, folder: Path) -> int:
        """The number of frames that have a file in a folder."""
        return len({named[1] for name in contents(folder) if (named := self.named(name))})

    @cached_property
    def unfinished(self) -> dict[str, bytes]:
        """The files of a capture that was killed when all frames were in the journal."""
        folder = self.new()
        self.start(folder, at=(r"os.rename \.manifest\.json", 1)).die(9)
        files = contents(folder)
        return {name: content for name, content in files.items() if not is_part(name)}

    def check_dead(self, folder: Path, said: list[str], over: bool = False) -> None:
        """Check that each file with a final name is whole, and that what was said is true; note the death.

        With `over`, files may also be those of `other`.
        """
        files = contents(folder) if folder.exists() else {}
        known = [self.undisturbed, self.other] if over else [self.undisturbed]
        for name, content in files.items():
            if self.named(name) or name in self._documents:
                assert any(content == one.get(name) for one in known), f"{name} is not whole"
            elif name == "manifest.json":
                assert any(is_same_json(content, one[name]) for one in known), "the manifest is another"
            else:
                assert _AUXILIARY.fullmatch(name) or is_part(name), f"{name} does not belong there"
        whole = [index for index, names in self.frames.items() if is_whole(names, files, self.undisturbed)]
        if not over:
            for index in journaled(files):
                assert index in whole, f"frame {index} is in the journal and is not whole"
        for line in said:
            if match := re.search(r"(\d+) of (\d+) frames are whole", line):
                assert int(match[1]) <= len(whole) or over, f"{line!r}, but {len(whole)} are"
        self.deaths.append(Death(len(whole), sum(map(is_part, files))))

    def finish(self, folder: Path, *words: object) -> list[str]:
        """Resume a capture, check that it ends as an undisturbed one, and return what it said."""
        said = self.start("--resume", *words, folder).end()
        self.check_whole(folder)
        return said

    def check_whole(self, folder: Path) -> None:
        """Check that a folder is that of an undisturbed capture."""
        files = contents(folder)
        odd = sorted(files.keys() ^ self.undisturbed.keys())
        assert not odd, f"files that do not belong there, or are missing: {odd}"
        for name, content in files.items():
            expected = self.undisturbed[name]
            if name == "manifest.json":
                assert is_same_json(content, expected), "the manifest is another"
            else:
                assert content == expected, f"{name} is another"


def contents(folder: Path) -> dict[str, bytes]:
    """All files below a folder, by their relative paths."""
    found = {}
    for path in sorted(folder.rglob("*")):
        if path.is_file():
            try:
                found[str(path.relative_to(folder))] = path.read_bytes()
            except FileNotFoundError:  # a temporary name
                continue
    return found


def is_part(name: str) -> bool:
    """Return True for the path of a file that has a temporary name."""
    return bool(_PART.fullmatch(name.rpartition("/")[2]))


def is_same_json(one: bytes, other: bytes) -> bool:
    """Whether two texts are JSON of the same content."""
    return bool(json.loads(one) == json.loads(other))


def is_whole(names: list[str], files: dict[str, bytes], expected: dict[str, bytes]) -> bool:
    """Whether all files of a frame are there as they should be."""
    return all(files.get(name) == expected[name] for name in names)


def journaled(files: dict[str, bytes]) -> set[int]:
    """The frames in whole lines of journals whose hashes are not those of an older file."""
    found = set()
    for name, content in files.items():
        if not name.startswith("journal"):
            continue
        for line in content.split(b"\n")[:-1]:
            if line.startswith(b'{"index"'):
                frame = json.loads(line)
                found.add(frame["index"])
                for output, path in frame["files"].items():
                    digest = hashlib.sha256(files.get(path, b"")).hexdigest()
                    assert digest == frame["file_sha256"][output], f"{path} is not as the journal says"
    return found


Kind = Callable[[Stage, Any], None]
"""Lets a capture die once or several times, at moments chosen by a random.Random, and checks everything."""
