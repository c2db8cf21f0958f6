"""``firefly doctor``: what it says here, and on machines that lack something."""

from __future__ import annotations

import json
import re
import subprocess
import sys

import numpy as np
import pytest

from firefly_sample.cli import main
from firefly_sample.commands.doctor import Finding, as_text
from firefly_sample.gpu.driver_checks import VARIABLES, vector_bits
from tests.cli.command import broken_gl, environment, firefly
from tests.conftest import make_renderer


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


def test_nothing_is_to_be_mended_where_only_extras_are_missing():
    """In words of the text: what is broken, and what could be added."""
    here = Finding("Python", True, True, "3.11")
    extra = Finding("embreex", False, False, "not installed", "pip install 'embreex>=4,<5'")
    broken = Finding("libGL", False, True, "not found", "apt-get install libgl1")
    noted = Finding("VARIABLE", True, False, "1: changes pictures", "unset VARIABLE")
    assert "To " not in as_text([here], True)
    assert "\n\nTo unset these variables:\n  unset VARIABLE\n\n" in as_text([here, noted], True)
    assert as_text([here, extra], True).endswith(
        "\n\nTo add optional parts:\n  pip install 'embreex>=4,<5'\n\nfirefly capture works here."
    )
    assert as_text([here, extra, broken], False).endswith(
        "\n\nTo fix it:\n  apt-get install libgl1\n\nTo add optional parts:\n"
        "  pip install 'embreex>=4,<5'\n\nfirefly capture cannot work here."
    )


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


def test_a_variable_that_makes_the_driver_crash(tmp_path, device):
    """With AVX, vectors of 128 bits make llvmpipe overwrite memory; without, they are its own."""
    env = environment(LP_NATIVE_VECTOR_WIDTH="128")
    done = firefly("doctor", "--json", cwd=tmp_path, env=env)
    ready, found = report(done.stdout)
    if vector_bits(device.renderer) in (None, 128):
        assert (ready, done.returncode) == (True, 0)
        return
    assert (ready, done.returncode, done.stderr) == (False, 1, "")
    assert found["LP_NATIVE_VECTOR_WIDTH"]["found"].startswith("128: ")
    for words in ("LP_NATIVE_VECTOR_WIDTH=128", "AVX", "unset it", "GALLIUM_OVERRIDE_CPU_CAPS=sse4.1"):
        assert words in found["device 0"]["found"]
    assert found["device 0"]["fix"] == "unset LP_NATIVE_VECTOR_WIDTH"


def test_what_a_processor_without_avx_would_draw(tmp_path, device):
    """The way out that the refusal names: narrow vectors, and other last digits."""
    env = environment(LP_NATIVE_VECTOR_WIDTH="128", GALLIUM_OVERRIDE_CPU_CAPS="sse4.1")
    options = ("--size", "64x48", "--frames", "0", "--outputs", "id,depth", "--json")
    done = [
        firefly("capture", "spheres", *options, "-o", folder, cwd=tmp_path, env=variables)
        for folder, variables in (("narrow", env), ("ours", environment()))
    ]
    assert [one.returncode for one in done] == [0, 0], done[0].stderr
    narrow, ours = (json.loads(one.stdout) for one in done)
    if vector_bits(device.renderer) is None:
        assert narrow["driver"] == ours["driver"]
        return
    assert vector_bits(narrow["driver"]) == 128
    # the same driver string is what promises the same bytes
    same = narrow["frames"][0]["sha256"] == ours["frames"][0]["sha256"]
    assert same == (narrow["driver"] == ours["driver"])
    for output, error in (("id", 0.0), ("depth", 1e-5)):
        images = [
            np.load(tmp_path / folder / f"{output}_000000.npz")[output] for folder in ("narrow", "ours")
        ]
        np.testing.assert_allclose(*images, rtol=error)


def test_a_variable_that_leaves_no_context_is_named(tmp_path, device):
    if vector_bits(device.renderer) is None:
        pytest.skip("only Mesa takes its version from the environment")
    done = firefly("doctor", "--json", cwd=tmp_path, env=environment(MESA_GL_VERSION_OVERRIDE="2.1"))
    assert done.returncode == 1
    _, found = report(done.stdout)
    assert "MESA_GL_VERSION_OVERRIDE=2.1" in found["device 0"]["found"]
    assert found["device 0"]["fix"] == "unset MESA_GL_VERSION_OVERRIDE"


@pytest.mark.parametrize("name", [name for name, variable in VARIABLES.items() if variable.silent])
def test_variables_that_change_pictures_in_silence_are_named(monkeypatch, capsys, device, name):
    """Their values are read when the first context is made: here they change nothing."""
    if vector_bits(device.renderer) is None:
        pytest.skip("the variable is llvmpipe's")
    monkeypatch.setenv(name, "anything")
    assert main(["doctor"]) == 0
    said = capsys.readouterr().out
    assert re.search(rf"^note +{name} +anything: makes llvmpipe ", said, re.MULTILINE)
    assert f"  unset {name}\n" in said
    with pytest.warns(UserWarning, match=f"{name}=anything in the environment makes llvmpipe .*: unset it"):
        make_renderer((1, 1)).close()


def test_doctor_says_where_frames_have_the_same_bytes(capsys, device):
    assert main(["doctor", "--json"]) == 0
    said = report(capsys.readouterr().out)[1]["same bytes"]["found"]
    if vector_bits(device.renderer) is not None:
        assert device.renderer in said
        assert ("with AVX" in said) == (vector_bits(device.renderer) >= 256)


@pytest.mark.parametrize(
    ("driver", "bits"),
    [
        ("llvmpipe (LLVM 15.0.6, 256 bits)", 256),
        ("llvmpipe (LLVM 12.0.0, 128 bits)", 128),
        ("softpipe", None),
        ("NVIDIA H200/PCIe/SSE2", None),
    ],
)
def test_vector_bits(driver, bits):
    assert vector_bits(driver) == bits


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
    assert found["rich"]["fix"].endswith(" -m pip install 'rich>=13'")
    assert (found["rich"]["needed"], found["glfw"]["needed"]) == (True, False)
