"""Deaths of captures that become one film: while frames are drawn, while they are bound, and after that."""

from __future__ import annotations

import re
import signal
import time
from functools import cached_property, lru_cache
from pathlib import Path
from random import Random

from tests.capture.kinds_of_kill import SIGNALS
from tests.capture.launch import Run, wait_for
from tests.capture.stage import OTHER, Death, Stage, contents, is_same_json

WORDS = ("tests.cli.glade:glade", "--size", "16x12", "--frames", "0:8")
SUFFIXES = (".mp4", ".apng", ".webp")
_FRAME = re.compile(r"color_(\d{6})\.png")
_AUXILIARY = re.compile(r"\.firefly\.lock|journal\.jsonl|manifest(\.previous)?\.json")
_PART = re.compile(r"\..+\.part")


class FilmStage:
    """A stage for films of one ending: their captures die and are resumed, each in a folder of its own."""

    def __init__(self, stage: Stage, suffix: str) -> None:
        self._stage = stage
        self.name = f"clip{suffix}"

    def new(self) -> Path:
        """The path of a film, in a folder that has nothing in it."""
        folder = self._stage.new("film")
        folder.mkdir()
        return folder / self.name

    def start(self, *words: str | Path, **options: object) -> Run:
        """Start a capture; the last word is its film."""
        clip = words[-1]
        assert isinstance(clip, Path)
        return self._stage.launcher.start(*WORDS, *words, watched=clip.parent, **options)

    def made(self, *words: str) -> dict[str, bytes]:
        """The files of a capture that nothing happened to: the film and its manifest."""
        clip = self.new()
        self.start(*words, clip).end()
        files = contents(clip.parent)
        assert files.keys() == {self.name, f"{self.name}.json"}, files.keys()
        return files

    @cached_property
    def undisturbed(self) -> dict[str, bytes]:
        return self.made()

    @cached_property
    def other(self) -> dict[str, bytes]:
        """The files of a capture with other settings."""
        return self.made(*OTHER)

    def _frames(self, *words: str) -> dict[str, bytes]:
        clip = self.new()
        self.start(*words, clip, at=(rf"open \.{re.escape(self.name)}\..*part", 1)).die(signal.SIGKILL)
        files = contents(clip.with_name(f"{self.name}.frames"))
        return {name: content for name, content in files.items() if _FRAME.fullmatch(name)}

    @cached_property
    def frames(self) -> dict[str, bytes]:
        """The frames of a capture, by their names."""
        return self._frames()

    @cached_property
    def other_frames(self) -> dict[str, bytes]:
        """Those of a capture with other settings."""
        return self._frames(*OTHER)

    @cached_property
    def operations(self) -> list[str]:
        """The file operations of a capture that nothing happened to."""
        clip = self.new()
        log = self._stage.new("operations")
        self.start(clip, log=log).end()
        return log.read_text().splitlines()

    @cached_property
    def seconds(self) -> float:
        """The seconds that an undisturbed capture takes."""
        begin = time.monotonic()
        self.made()
        return time.monotonic() - begin

    def check_dead(self, clip: Path, said: list[str], over: bool, is_sudden: bool) -> None:
        """Check that each file with a final name is whole, and that what was said is true; note the death."""
        known = [self.undisturbed, self.other] if over else [self.undisturbed]
        whole, parts = 0, 0
        for path, content in contents(clip.parent).items():
            folder, _, name = path.rpartition("/")
            if folder and _FRAME.fullmatch(name):
                is_ours = content == self.frames[name]
                whole += is_ours
                assert is_ours or (over and content == self.other_frames[name]), f"{path} is not whole"
            elif not folder and name == self.name:
                assert any(content == one[name] for one in known), f"{path} is not whole"
            elif not folder and name == f"{self.name}.json":
                assert any(is_same_json(content, one[name]) for one in known), f"{path} is another"
            else:
                assert _PART.fullmatch(name) or (folder and _AUXILIARY.fullmatch(name)), f"what is {path}?"
                parts += bool(_PART.fullmatch(name))
        assert is_sudden or not parts, "a .part file is left after a signal that can be handled"
        for line in said:
            if (match := re.search(r"(\d+) of (\d+) frames are whole", line)) and not over:
                assert int(match[1]) <= whole, f"{line!r}, but {whole} are"
        self._stage.deaths.append(Death(whole, parts))

    def finish(self, clip: Path) -> None:
        """Resume a capture, and check that it ends as an undisturbed one."""
        self.start("--resume", clip).end()
        self.check_whole(clip)

    def check_whole(self, clip: Path) -> None:
        """Check that there is the film of an undisturbed capture, its manifest, and nothing else."""
        files = contents(clip.parent)
        left = sorted(path.name for path in clip.parent.iterdir())
        assert left == sorted(self.undisturbed), f"files that do not belong there, or are missing: {left}"
        assert files[self.name] == self.undisturbed[self.name], f"{self.name} is another"
        name = f"{self.name}.json"
        assert is_same_json(files[name], self.undisturbed[name]), "the manifest is another"


@lru_cache(maxsize=len(SUFFIXES))
def films_of(stage: Stage, suffix: str) -> FilmStage:
    """The place for films with an ending, made once."""
    return FilmStage(stage, suffix)


def at_operations(films: FilmStage, moments: list[tuple[str, int, int]], over: bool = False) -> None:
    """Kill a capture before file operations (pattern, count and signal), and go on after each."""
    clip = films.new()
    words = _overwritten(films, clip) if over else []
    for pattern, count, number in moments:
        run = films.start(*words, clip, at=(pattern, count), number=number)
        wait_for(lambda run=run: run.poll() is not None, "the end")
        if run.poll() == 0:
            films.check_whole(clip)
            break
        films.check_dead(clip, run.die(number), over, number == signal.SIGKILL)
        words = ["--resume"]
    films.finish(clip)


def of_films(stage: Stage, rng: Random) -> None:
    """One to three deaths in a row, at random moments or file operations, of a new film or an older one."""
    films = films_of(stage, rng.choice(SUFFIXES))
    over = rng.random() < 0.3
    if rng.random() < 0.5:
        number = len(films.operations)
        moments = [(".", rng.randint(1, number), rng.choice(SIGNALS)) for _ in range(rng.randint(1, 3))]
        at_operations(films, moments, over)
        return
    clip = films.new()
    words = _overwritten(films, clip) if over else []
    for _ in range(rng.randint(1, 3)):
        run = films.start(*words, clip)
        end = time.monotonic() + rng.uniform(0.2, 1.0) * films.seconds
        wait_for(lambda run=run, end=end: run.poll() is not None or time.monotonic() > end, "a moment")
        number = rng.choice(SIGNALS)
        if run.poll() is None:
            run.kill(number)
        wait_for(lambda run=run: run.poll() is not None, "the end")
        if (run.poll() in (0, -number) and number != signal.SIGKILL) or run.poll() == 0:
            break  # it was faster, or only the end of the process was left
        films.check_dead(clip, run.die(number), over, number == signal.SIGKILL)
        words = ["--resume"]
    if run.poll() == 0:
        films.check_whole(clip)
    films.finish(clip)


def _overwritten(films: FilmStage, clip: Path) -> list[str]:
    """Put another film in the place of a new one; return how to replace it."""
    for name, content in films.other.items():
        (clip.parent / name).write_bytes(content)
    return ["--overwrite"]
