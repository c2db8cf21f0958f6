"""``firefly doctor``: what it says here, and on machines that lack something."""

from __future__ import annotations

import json
import subprocess
import sys

from firefly_sample.cli import main
from tests.cli.command import broken_gl, environment, firefly


def report(text):
    told = json.loads(text)
    return told["ready"], {finding["name"]: finding for finding in told["findings"]}


def test_this_machine_can_capture(capsys, device):
    assert main(["doctor", "--json"]) == 0
    ready, found = report(capsys.readouterr().out)
    assert ready
    assert device.renderer in found["device 0"]["found"]
    assert device.version in found["device 0"]["found"]
    assert ("software" in found["device 0"]["found"]) == device.software
    assert found["reversed depth"]["ok"] == device.capabilities.clip_control
    assert found["signed normals"]["ok"] == device.capabilities.snorm_targets
    assert found["largest picture"]["found"].startswith(f"{device.max_size} ")
    assert found["moderngl"]["found"].count(".") >= 1
    assert not [finding for finding in found.values() if finding["ok"] and finding["fix"]]


def test_the_text_has_every_finding(capsys):
    assert main(["doctor", "--json"]) == 0
    _, found = report(capsys.readouterr().out)
    assert main(["doctor"]) == 0
    text = capsys.readouterr().out
    assert text.endswith("firefly capture works here.\n")
    for finding in found.values():
        line = next(line for line in text.splitlines() if finding["found"] in line)
        assert line.startswith("ok" if finding["ok"] else "without")


def test_without_gl_libraries(tmp_path):
    done = firefly("doctor", "--json", cwd=tmp_path, env=broken_gl(tmp_path / "lib"))
    assert (done.returncode, done.stderr) == (1, "")
    ready, found = report(done.stdout)
    assert not ready
    for name, package in (("libGL", "libgl1"), ("libEGL", "libegl1")):
        assert not found[name]["ok"]
        assert found[name]["fix"] == f"apt-get install --no-install-recommends {package}"
    assert "libgl1-mesa-dri" in found["device"]["fix"]


def test_where_the_loader_knows_no_gl_library(tmp_path):
    code = (
        "import ctypes.util, sys; ctypes.util.find_library = lambda name: None\n"
        "from firefly_sample.cli import main; sys.exit(main(['doctor']))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=tmp_path,
        env=environment(LD_LIBRARY_PATH=broken_gl(tmp_path / "lib")["LD_LIBRARY_PATH"]),
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )
    assert (done.returncode, done.stderr) == (1, "")
    assert "MISSING  libGL" in done.stdout
    assert "  apt-get install --no-install-recommends libgl1\n" in done.stdout
    assert done.stdout.endswith("firefly capture cannot work here.\n")


def test_a_device_that_does_not_exist(tmp_path):
    done = firefly("doctor", "--json", cwd=tmp_path, env=environment(GLCONTEXT_DEVICE_INDEX="77"))
    assert (done.returncode, done.stderr) == (1, "")
    ready, found = report(done.stdout)
    assert not ready
    assert "'77'" in found["device"]["found"]
    assert found["device"]["fix"] == "unset GLCONTEXT_DEVICE_INDEX"
    assert found["device 0"]["ok"]


def test_without_a_display_a_capture_still_works(tmp_path):
    env = environment()
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        env.pop(name, None)
    done = firefly("doctor", "--json", cwd=tmp_path, env=env)
    ready, found = report(done.stdout)
    assert ready
    assert not found["display"]["ok"]
    assert not found["display"]["needed"]


def test_a_display_that_is_not_there(tmp_path):
    env = environment(DISPLAY=":4242")
    env.pop("WAYLAND_DISPLAY", None)
    done = firefly("doctor", "--json", cwd=tmp_path, env=env)
    assert (done.returncode, done.stderr) == (0, "")
    assert report(done.stdout)[1]["display"]["found"] == ":4242 cannot be opened"


def test_a_missing_package(tmp_path):
    """Packages are looked up by their metadata: hide one distribution's."""
    code = (
        "import importlib.metadata as m, sys\n"
        "real = m.version\n"
        "def version(name):\n"
        "    if name in ('glfw', 'rich'): raise m.PackageNotFoundError(name)\n"
        "    return real(name)\n"
        "m.version = version\n"
        "from firefly_sample.cli import main; sys.exit(main(['doctor', '--json']))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=tmp_path,
        env=environment(),
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )
    ready, found = report(done.stdout)
    assert (ready, done.returncode) == (False, 1)
    assert found["rich"]["fix"].startswith("pip install 'rich")
    assert (found["rich"]["needed"], found["glfw"]["needed"]) == (True, False)
