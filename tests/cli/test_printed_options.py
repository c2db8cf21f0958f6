"""Every option that is printed anywhere, in help, errors or pages, is one that there is."""

from __future__ import annotations

import ast
import re
import shlex
from pathlib import Path

import pytest

import firefly_sample
from firefly_sample import cli
from firefly_sample.commands.options import COMMAND_OPTIONS, scene_options
from firefly_sample.model.formats import is_panda3d
from firefly_sample.scenes import find_scene, list_scenes
from tests.tabletop import installed

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
OTHERS = {
    *("--no-install-recommends", "--force-reinstall", "--nthreads", "--data", "--depth-unit-scale-factor"),
    *("--height", "--update-golden"),
}
"""Options of apt-get, pip, dask, nerfstudio, and of the scene plugin and the conftest.py that pages show."""
OPTION = re.compile(r"(?<![\w-])--[a-z][a-z-]*[a-z]\b")


def names_of(words, plugin=None):
    """The options of a command."""
    app = cli.make_app({words}, [], plugin)
    for word in words:
        app = app[word]
    return {name for argument in app.assemble_argument_collection() for name in argument.names}


@pytest.fixture(scope="module", autouse=True)
def tabletop(tmp_path_factory):
    """The scene of docs/tabletop.md, which its commands draw."""
    with installed(tmp_path_factory.mktemp("tabletop")):
        yield


@pytest.fixture(scope="module")
def known(tabletop):
    """The options of all commands with all scenes."""
    names = {"--help", "--help-all", "--version"}
    for words in cli.COMMANDS:
        names |= names_of(words, find_scene("forest") if words in cli.WITH_SCENE else None)
    for plugin in (*list_scenes(), find_scene("tests.cli.glade:crowded")):
        for option, parameter in scene_options(plugin).items():
            names |= {option, option.replace("--", "--no-")} if parameter.default is True else {option}
    return names


def texts_of(path):
    """The strings of a module, docstrings of code that is not printed among them."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield node.value


def test_options_in_messages_and_pages_exist(known):
    said = {
        (option, path.name)
        for path in Path(firefly_sample.__file__).parent.rglob("*.py")
        for text in texts_of(path)
        for option in OPTION.findall(text)
    }
    said |= {(option, path.name) for path in PAGES for option in OPTION.findall(path.read_text())}
    assert len(said) > 50
    assert {(option, where) for option, where in said if option not in known | OTHERS} == set()


def test_scenes_prints_the_options_that_commands_take(capsys):
    assert cli.main(["scenes"]) == 0
    text = capsys.readouterr().out
    for plugin in list_scenes():
        assert scene_options(plugin).keys() <= names_of(("plan",), plugin)
        part = text.split(f"{plugin.name}: ")[1]
        printed = OPTION.findall("\n".join(line for line in part.splitlines()[1:] if line.startswith("  --")))
        assert printed[: len(plugin.parameters)] == list(scene_options(plugin))
    assert "  --lights  256 " in text


def test_no_command_has_an_option_that_a_scene_could_take_from_it():
    plugin = find_scene("tests.cli.glade:empty")
    settings = {name.replace("_", "-") for name in firefly_sample.Settings().as_dict()}
    others = {name.replace("_", "-") for name in COMMAND_OPTIONS}
    for words in cli.WITH_SCENE:
        own = {
            name.lstrip("-").removeprefix("no-").removeprefix("empty-") for name in names_of(words, plugin)
        }
        assert own <= settings | others, words


COMMANDS = [
    line.split("  #")[0].strip()
    for page in PAGES
    for block in re.findall(r"```sh\n(.*?)```", page.read_text(), re.DOTALL)
    for line in block.splitlines()
    if line.startswith("firefly ")
]


@pytest.mark.parametrize("line", COMMANDS)
def test_commands_on_the_pages_can_be_understood(line, tmp_path, monkeypatch):
    tokens = shlex.split(line)[1:]
    files = [Path(file) for token in tokens for file in token.split(",") if is_panda3d(Path(file))]
    if files:  # this project has none: they are the user's own
        monkeypatch.chdir(tmp_path)
        for file in files:
            file.touch()
    words = next(words for words in cli.COMMANDS if tuple(tokens[: len(words)]) == words)
    plugin = cli.scene_of(words, tokens, []) if words in cli.WITH_SCENE else None
    assert callable(cli.parse(words, tokens, [], plugin))
