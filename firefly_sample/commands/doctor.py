"""``firefly doctor``: a report on this machine, and the commands that install missing parts."""

from __future__ import annotations

import os
import platform
import re
import sys
import warnings
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING

from firefly_sample.columns import align
from firefly_sample.commands.options import Flag
from firefly_sample.commands.terminal import print_json, print_result
from firefly_sample.errors import FireflyError, ViewerError
from firefly_sample.extras import pip_install
from firefly_sample.gpu.driver_checks import VARIABLES, variables_set, vector_bits

if TYPE_CHECKING:
    from firefly_sample.gpu.device import Device

_FIXES = {
    "MISSING": "To fix it:",
    "without": "To add optional parts:",
    "note": "To unset these variables:",
}
"""Headings of the lists of commands below the table, by the mark of their findings."""
APT = "apt-get install --no-install-recommends"


@dataclass(frozen=True)
class Finding:
    """One line of the report, with the command that mends or adds the thing, if there is one."""

    name: str
    ok: bool
    needed: bool
    """True if nothing can be captured without it."""
    found: str
    """The thing that was found, or the problem."""
    fix: str = ""


def doctor(*, json: Flag = False) -> int:
    """Show driver, devices, versions and missing parts, and the commands that install these.

    The exit code is 0 if firefly capture works here, 1 otherwise.

    Parameters
    ----------
    json
        Print JSON.
    """
    findings = examine()
    ready = all(finding.ok for finding in findings if finding.needed)
    if json:
        print_json({"ready": ready, "findings": [asdict(finding) for finding in findings]})
    else:
        print_result(as_text(findings, ready))
    return 0 if ready else 1


def examine() -> list[Finding]:
    """Return all findings about this machine; a check that fails is a finding, not an exception."""
    return [
        Finding("Python", True, True, f"{platform.python_version()} ({sys.executable})"),
        Finding("platform", True, True, platform.platform()),
        *_packages(),
        *_assets(),
        _library("GL", "libgl1"),
        _library("EGL", "libegl1"),
        *_variables(),
        *_devices(),
        _display(),
    ]


def as_text(findings: list[Finding], ready: bool) -> str:
    """Return the report as a table, followed by the commands that mend, add or undo things."""
    lines = align([(_mark(finding), finding.name, finding.found) for finding in findings]).splitlines()
    for mark, head in _FIXES.items():
        fixes = dict.fromkeys(finding.fix for finding in findings if finding.fix and _mark(finding) == mark)
        if fixes:
            lines += ["", head, *(f"  {fix}" for fix in fixes)]
    return "\n".join([*lines, "", f"firefly capture {'works' if ready else 'cannot work'} here."])


def _mark(finding: Finding) -> str:
    if finding.ok:
        return "note" if finding.fix else "ok"
    return "MISSING" if finding.needed else "without"


def _packages() -> Iterator[Finding]:
    """Yield the distribution's own requirements and their installed versions."""
    from importlib.metadata import PackageNotFoundError, requires, version

    try:
        yield Finding("firefly_sample", True, True, version("firefly_sample"))
    except PackageNotFoundError:
        yield Finding("firefly_sample", False, True, "not installed", "pip install .")
        return
    for requirement in requires("firefly_sample") or ():
        spec, _, marker = (part.strip() for part in requirement.partition(";"))
        name = re.split(r"[^\w.-]", spec, maxsplit=1)[0]
        needed = "extra" not in marker
        try:
            yield Finding(name, True, needed, version(name))
        except PackageNotFoundError:
            yield Finding(name, False, needed, "not installed", pip_install([spec]))


def _assets() -> Iterator[Finding]:
    from firefly_sample.assets import asset_dir

    for kind in ("shaders", "models"):
        try:
            yield Finding(kind, True, True, str(asset_dir(kind)))
        except FireflyError as error:
            yield Finding(kind, False, True, str(error), pip_install(["--force-reinstall", "firefly_sample"]))


def _library(name: str, package: str) -> Finding:
    """Find a library in the way glcontext does, and load it."""
    import ctypes
    from ctypes.util import find_library

    file = os.environ.get(f"GLCONTEXT_LINUX_LIB{name}") or find_library(name)
    problem = "not found"
    if file is not None:
        try:
            ctypes.CDLL(file)
            return Finding(f"lib{name}", True, True, file)
        except OSError as error:
            problem = f"{file} cannot be loaded: {error}"
    return Finding(f"lib{name}", False, True, problem, f"{APT} {package}")


def _variables() -> Iterator[Finding]:
    """Yield the environment variables that change what drivers draw, or prevent drawing."""
    for name, value in variables_set().items():
        variable = VARIABLES[name]
        unsaid, fix = (", and call itself the same", f"unset {name}") if variable.silent else ("", "")
        yield Finding(name, True, False, f"{value}: {variable.effect}{unsaid}", fix)


def _devices() -> Iterator[Finding]:
    """Yield every EGL device, and the capabilities of the default one."""
    count = _device_count()
    if isinstance(count, Finding):
        yield count
        return
    given = os.environ.get("GLCONTEXT_DEVICE_INDEX", "0")
    chosen = int(given) if given.isdigit() else -1
    if not 0 <= chosen < count:
        found = f"GLCONTEXT_DEVICE_INDEX is {given!r}, but the devices are 0 to {count - 1}"
        yield Finding("device", False, True, found, "unset GLCONTEXT_DEVICE_INDEX")
    for index in range(count):
        yield from _device(index, chosen=index == chosen)


def _device_count() -> int | Finding:
    """Count the EGL devices; the error for a device that does not exist contains their number."""
    from firefly_sample.gpu.device import Device

    try:
        Device(10**6).release()
    except FireflyError as error:
        match = re.search(r"found (\d+) device", str(error))
        if match is not None and int(match[1]):
            return int(match[1])
        return Finding("device", False, True, str(error), f"{APT} libegl1 libgl1 libgl1-mesa-dri")
    return 1  # the driver does not number its devices


def _device(index: int, chosen: bool) -> Iterator[Finding]:
    from firefly_sample.gpu.device import Device

    name = f"device {index}"
    try:
        device = Device(index)
    except FireflyError as error:
        names = " ".join(variables_set())
        fix = f"unset {names}" if names else f"{APT} libgl1-mesa-dri"
        yield Finding(name, False, chosen, str(error), fix)
        return
    kind = "software, slow" if device.software else "GPU"
    yield Finding(name, True, chosen, f"{device.renderer} ({kind}); {device.vendor}; OpenGL {device.version}")
    if chosen:
        yield Finding("same bytes", True, False, _same_bytes(device))
        can = device.capabilities
        found = "yes" if can.clip_control else "no; position_method=depth32f is as coarse as depth24"
        yield Finding("reversed depth", can.clip_control, False, found)
        found = "yes" if can.snorm_targets else "no; normals are stored in RG16"
        yield Finding("signed normals", can.snorm_targets, False, found)
        yield Finding("largest picture", True, True, f"{device.max_size} pixels a side")
    device.release()


def _same_bytes(device: Device) -> str:
    """Return on which machines a frame has the same bytes."""
    bits = vector_bits(device.renderer)
    if bits is None:
        return "on this kind of device with this version of the driver"
    processors = "with AVX" if bits >= 256 else "without AVX"
    mesa = device.version.rpartition(" ")[2]
    return f"on every machine with {device.renderer} of Mesa {mesa}; these have processors {processors}"


def _display() -> Finding:
    """Check whether a window can be opened."""
    where = os.environ.get("WAYLAND_DISPLAY") or os.environ.get("DISPLAY")
    if not where:
        return Finding("display", False, False, "none; firefly run needs one, firefly capture does not")
    from firefly_sample.viewer.glfw_window import load_glfw

    try:
        glfw = load_glfw()
    except ViewerError:
        return Finding("display", True, False, f"{where}, not tried because glfw is not installed")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the result of init() suffices
        opened = bool(glfw.init())
        glfw.terminate()
    return Finding("display", opened, False, where if opened else f"{where} cannot be opened")
