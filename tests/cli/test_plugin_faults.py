"""Faults of a scene plugin in import, build and update: each is one line that names plugin and place."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from firefly_sample.cli import main

PLUGIN = """
import sys
from firefly_sample import Scene

def fail():
    {what}

if "{where}" == "import":
    fail()

class Trouble(Scene):
    def update(self, time):
        if "{where}" == "update":
            fail()

class Plugin:
    name = "trouble"
    summary = "Fails."
    parameters = ()

    def build(self):
        if "{where}" == "build":
            fail()
        return Trouble()

plugin = Plugin()
"""
WHATS = {
    "sys.exit(0)": "sys.exit was called: 0",
    "sys.exit('enough')": "sys.exit was called: enough",
    "raise SystemExit": "sys.exit was called",
    "raise GeneratorExit": "GeneratorExit",
    "raise MemoryError": "MemoryError",
    "1 / 0": "ZeroDivisionError: division by zero",
    "fail()": "RecursionError: maximum recursion depth exceeded",
    "open('missing')": "FileNotFoundError: ",
    "raise BrokenPipeError": "BrokenPipeError",
}


@pytest.fixture
def write(tmp_path, monkeypatch):
    """``write(what, where)`` makes the module ``trouble``."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)

    def make(what, where):
        (tmp_path / "trouble.py").write_text(PLUGIN.format(what=what, where=where))

    yield make
    for name in ("trouble", "elsewhere"):
        sys.modules.pop(name, None)


@pytest.mark.parametrize("where", ["import", "build", "update"])
@pytest.mark.parametrize("what", WHATS)
def test_it_is_one_line_that_names_the_plugin_and_the_place(tmp_path, capsys, write, what, where):
    write(what, where)
    assert main(["plan", "trouble:plugin"]) == 1
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("firefly: scene 'trouble")
    assert WHATS[what] in err
    assert f"({tmp_path / 'trouble.py'}:6)" in err
    assert err.count("\n") == 1


HELPER = """
import sys
from firefly_sample import Scene

class Trouble(Scene):
    def update(self, time):
        {what}
"""
KINDS = {
    "an object of another module's class": "types.SimpleNamespace(**parts, build=build)",
    "the package's own class": "Plugin('trouble', 'Fails.', (), build)",
    "a partial function": "types.SimpleNamespace(**parts, build=partial(build))",
}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("package", ["trouble", "elsewhere"])
@pytest.mark.parametrize("what", ["sys.exit(0)", "1 / 0"])
def test_however_a_plugin_is_made(tmp_path, capsys, write, kind, package, what):
    """Also where the scene's class is in another package than the plugin."""
    write("pass", "nowhere")
    (tmp_path / f"{package}.py").write_text(HELPER.format(what=what))
    own = f"from {package} import Trouble" if package != "trouble" else ""
    with (tmp_path / "trouble.py").open("a") as module:
        module.write(f"""
import types
from functools import partial
from firefly_sample.scenes.plugin import Plugin
{own}
def build():
    return Trouble()
parts = {{"name": "trouble", "summary": "", "parameters": ()}}
plugin = {KINDS[kind]}
""")
    assert main(["capture", "trouble:plugin", "--size", "8x6", "-o", str(tmp_path / "out")]) == 1
    out, err = capsys.readouterr()
    err = [line for line in err.splitlines() if "warning: " not in line]
    assert (out, len(err)) == ("", 1)
    assert err[0].startswith("firefly: scene 'trouble': ")
    assert f"({tmp_path / package}.py:7)" in err[0]


def test_ctrl_c_in_a_plugin_is_ctrl_c(capsys, write):
    write("raise KeyboardInterrupt", "update")
    assert main(["plan", "trouble:plugin"]) == 130
    assert capsys.readouterr().err == "firefly: interrupted\n"


def test_memory_that_is_not_there_is_one_line(capsys, write, monkeypatch):
    write("pass", "nowhere")
    monkeypatch.setattr("firefly_sample.pipeline.build_plan", lambda *_: np.empty(2**46))
    assert main(["plan", "trouble:plugin"]) == 1
    err = capsys.readouterr().err
    assert err.startswith("firefly: out of memory: Unable to allocate 512. TiB")
    assert err.count("\n") == 1
