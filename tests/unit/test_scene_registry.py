"""How scenes are found: as entry points, as package.module:object, and what is said when they are not."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from firefly_sample.errors import ModelError, ParameterError, SceneError, SceneNotFoundError
from firefly_sample.scenes import build_scene, find_scene, list_scenes

PLUGIN = """
from firefly_sample.scene.parameter import Parameter
from firefly_sample.scene.scene import Scene

class Plugin:
    name = "glade"
    summary = "A test of the registry."
    parameters = (Parameter("trees", int, 3, "How many.", minimum=0, maximum=9),)

    def build(self, **parameters):
        scene = Scene()
        scene.given = parameters
        return scene

scene = Plugin()
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """An importable folder; the modules imported from it are forgotten afterwards."""
    monkeypatch.syspath_prepend(tmp_path)
    before = set(sys.modules)
    yield tmp_path
    for name in set(sys.modules) - before:
        if str(tmp_path) in str(getattr(sys.modules[name], "__file__", "")):
            del sys.modules[name]


def write_distribution(folder: Path, package: str, *entries: str) -> None:
    """What installing `package` leaves behind for importlib.metadata to find."""
    info = folder / f"{package}-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {package}\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("\n".join(["[firefly_sample.scenes]", *entries]) + "\n")


def test_module_and_object(folder: Path) -> None:
    package = folder / "registry_a"
    package.mkdir()
    (package / "__init__.py").write_text("")
    (package / "deep.py").write_text(PLUGIN)
    plugin = find_scene("registry_a.deep:scene")
    assert plugin.name == "glade"
    assert plugin is sys.modules["registry_a.deep"].scene


def test_entry_point_of_another_package(folder: Path) -> None:
    (folder / "registry_b.py").write_text(PLUGIN)
    write_distribution(folder, "registry_b", "glade = registry_b:scene")
    plugin = find_scene("glade")
    assert plugin is sys.modules["registry_b"].scene
    names = [scene.name for scene in list_scenes()]
    assert names == sorted(names)
    assert set(names) >= {"forest", "glade"}


def test_a_package_that_comes_or_goes_meanwhile_is_seen(folder: Path) -> None:
    """Which scenes are installed is kept from one question to the next."""
    for package in ("registry_one", "registry_two"):
        name = package.removeprefix("registry_")
        with pytest.raises(SceneNotFoundError):
            find_scene(name)
        (folder / f"{package}.py").write_text(PLUGIN.replace("glade", name))
        write_distribution(folder, package, f"{name} = {package}:scene")
        assert find_scene(name).name == name
    shutil.rmtree(folder / "registry_one-1.0.dist-info")
    assert find_scene("two").name == "two"
    with pytest.raises(SceneNotFoundError):
        find_scene("one")


@pytest.mark.parametrize("name", ["forest", "lightbulbs", "model", "smoke", "spheres"])
def test_the_scenes_of_this_package_are_installed(name: str) -> None:
    assert find_scene(name).name == name
    assert name in [scene.name for scene in list_scenes()]


def test_build_resolves_parameters(folder: Path) -> None:
    (folder / "registry_c.py").write_text(PLUGIN)
    plugin = find_scene("registry_c:scene")
    assert vars(build_scene(plugin))["given"] == {"trees": 3}
    assert vars(build_scene(plugin, trees=5))["given"] == {"trees": 5}
    with pytest.raises(ParameterError, match=r"scene 'glade' has no parameter 'plugin': it has trees"):
        build_scene(plugin, plugin=1)
    with pytest.raises(ParameterError, match="trees must be between 0 and 9, got 10"):
        build_scene(plugin, trees=10)


def message(name: str, kind: type[SceneError] = SceneNotFoundError) -> str:
    with pytest.raises(kind) as caught:
        find_scene(name)
    text = str(caught.value)
    assert "\n" not in text
    return text


def test_unknown_name_lists_the_known_and_suggests() -> None:
    assert message("forst").startswith("there is no scene 'forst' (did you mean 'forest'?); installed: ")
    assert message("desert").startswith("there is no scene 'desert'; installed: ")
    assert "forest" in message("desert")
    assert "package.module:object" in message("")


def test_a_name_without_its_suffix_suggests_the_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "florist.glb").touch()
    assert message("florist").startswith("there is no scene 'florist' (did you mean 'florist.glb'?); ")
    assert message("notes.txt").startswith("there is no scene or file 'notes.txt'; installed: ")


@pytest.mark.parametrize("name", ["a:", ":b", "a b:c", "a..b:c", "a:b:c", "a.py:1"])
def test_malformed_names(name: str) -> None:
    assert "is not of the form package.module:object" in message(name)


def test_missing_module_and_object(folder: Path) -> None:
    assert "registry_none cannot be imported" in message("registry_none:scene")
    (folder / "registry_d.py").write_text(PLUGIN)
    assert "registry_d has no 'scenery'" in message("registry_d:scenery")
    (folder / "registry_e.py").write_text("import registry_missing_library\n")
    assert "No module named 'registry_missing_library'" in message("registry_e:scene")


def test_not_a_plugin(folder: Path) -> None:
    (folder / "registry_f.py").write_text('class scene:\n    name = "f"\n    summary = "s"\n')
    assert "it has no parameters, build" in message("registry_f:scene", SceneError)


def test_a_module_that_raises(folder: Path) -> None:
    path = folder / "registry_g.py"
    path.write_text("import json\n\ndef f():\n    json.loads('[')\n\nf()\n")
    with pytest.raises(SceneError) as caught:
        find_scene("registry_g:scene")
    assert str(caught.value) == (
        "scene 'registry_g:scene': registry_g cannot be imported: "
        f"JSONDecodeError: Expecting value: line 1 column 2 (char 1) ({path}:4)"
    )
    assert isinstance(caught.value.__cause__, ValueError)


def test_a_module_that_raises_many_lines_or_none(folder: Path) -> None:
    (folder / "registry_k.py").write_text("raise RuntimeError('one\\n  two')\n")
    assert f"RuntimeError: one two ({folder}/registry_k.py:1)" in message("registry_k:scene", SceneError)
    (folder / "registry_l.py").write_text("assert False\n")
    text = message("registry_l:scene", SceneError)
    assert text.endswith(f"cannot be imported: AssertionError ({folder}/registry_l.py:1)")


@pytest.mark.parametrize("broken", ["registry_m", "registry_m_part"])
def test_a_module_that_is_not_python(folder: Path, broken: str) -> None:
    (folder / "registry_m.py").write_text("import registry_m_part\n")
    (folder / f"{broken}.py").write_text("a = 1\nb = = 2\n")
    text = message("registry_m:scene", SceneError)
    assert text == (
        "scene 'registry_m:scene': registry_m cannot be imported: "
        f"SyntaxError: invalid syntax ({folder}/{broken}.py:2)"
    )


def test_a_module_that_raises_an_error_of_ours(folder: Path) -> None:
    (folder / "registry_n.py").write_text(
        "from firefly_sample.errors import ModelError\nraise ModelError('tree.glb is missing')\n"
    )
    with pytest.raises(ModelError, match=r"^tree\.glb is missing$"):
        find_scene("registry_n:scene")


def build_text(folder: Path, module: str, *body: str) -> str:
    """What is said of a plugin whose build() is `body`, which starts in line 10 of its module."""
    head = PLUGIN[: PLUGIN.index("        scene = Scene()")]
    lines = "".join(f"        {line}\n" for line in body)
    (folder / f"{module}.py").write_text(f"{head.lstrip()}{lines}\nscene = Plugin()\n")
    plugin = find_scene(f"{module}:scene")
    with pytest.raises(SceneError) as caught:
        build_scene(plugin)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_a_build_that_raises(folder: Path) -> None:
    text = build_text(folder, "registry_o", "import json", "return json.loads(parameters)")
    path = folder / "registry_o.py"
    assert text.startswith("scene 'glade': build() failed: TypeError: the JSON object must be ")
    assert text.endswith(f" ({path}:11)")


def test_a_build_that_raises_an_error_of_ours(folder: Path) -> None:
    body = ("from firefly_sample.errors import LightError", "raise LightError('too bright')")
    assert build_text(folder, "registry_p", *body) == "too bright"


@pytest.mark.parametrize(("value", "kind"), [("None", "NoneType"), ("{}", "dict"), ("Scene", "type")])
def test_a_build_that_gives_no_scene(folder: Path, value: str, kind: str) -> None:
    module = f"registry_q_{kind}"
    assert build_text(folder, module, f"return {value}") == (
        f"scene 'glade': build() must give a Scene, got {kind} ({folder}/{module}.py:9)"
    )


def test_entry_point_under_another_name(folder: Path) -> None:
    (folder / "registry_h.py").write_text(PLUGIN)
    write_distribution(folder, "registry_h", "meadow = registry_h:scene")
    text = message("meadow", SceneError)
    assert "'meadow' calls itself 'glade'" in text
    with pytest.raises(SceneError, match="'meadow' calls itself 'glade'"):
        list_scenes()


def test_two_packages_one_name(folder: Path) -> None:
    (folder / "registry_i.py").write_text(PLUGIN)
    write_distribution(folder, "registry_i", "glade = registry_i:scene")
    write_distribution(folder, "registry_j", "glade = registry_j:scene")
    text = message("glade", SceneError)
    assert "two packages bring a scene 'glade'" in text
    assert "registry_i:scene" in text
    assert "registry_j:scene" in text
