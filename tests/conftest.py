"""Fixtures that several kinds of tests share, and how Hypothesis searches here."""

from __future__ import annotations

import gc
import importlib
import os
import sys
import tempfile
import warnings
from contextlib import contextmanager

import pytest
from hypothesis import settings as search

from firefly_sample import Renderer, SoftwareDriverWarning
from firefly_sample.assets import asset_dir
from firefly_sample.disk_cache import VARIABLE
from firefly_sample.gpu.device import Device
from firefly_sample.settings import Settings

# the same examples each run, and no clock, since machines differ
search.register_profile("repeatable", deadline=None, derandomize=True)
search.load_profile("repeatable")


# what is tested is made by this run, once, and not by another version in the user's cache
if VARIABLE not in os.environ:
    _derived = tempfile.TemporaryDirectory(prefix="firefly-tests-", ignore_cleanup_errors=True)
    os.environ[VARIABLE] = _derived.name
# without a home, Mesa would compile every shader anew for each renderer, which takes six times as long
if "HOME" not in os.environ:
    os.environ.setdefault("MESA_SHADER_CACHE_DIR", f"{tempfile.gettempdir()}/firefly-tests-{os.getuid()}")


def pytest_addoption(parser):
    parser.addoption("--all-variants", action="store_true", help="compile every variant of every shader")
    parser.addoption("--all-methods", action="store_true", help="draw every extreme by every method")


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report(collector):
    """Let every second worker import the tests from the last to the first.

    In a new checkout each then compiles half of them, and finds the other half compiled.
    """
    report = yield
    if isinstance(collector, pytest.Directory) and _number_of_worker(collector.config) % 2:
        report.result.reverse()
    return report


LONG_FILES = (
    "tests/viewer/test_window.py",
    "tests/lab/test_stability.py",
    "tests/capture/test_cluster.py",
    "tests/passes/test_lights.py",
    "tests/viewer/test_smoke.py",
    "tests/lab/test_choice.py",
    "tests/viewer/test_other_libraries.py",
    "tests/model/test_formats.py",
    "tests/capture/test_deaths.py",
    "tests/passes/test_lifetime.py",
    "tests/cli/test_wheel.py",
    "tests/passes/test_particle_shadows.py",
    "tests/lab/test_start.py",
    "tests/passes/test_live_changes.py",
    "tests/lab/test_start_caches.py",
    "tests/passes/test_shadows.py",
    "tests/model/test_mutated_files.py",
    "tests/passes/test_culling.py",
    "tests/capture/test_processes.py",
    "tests/passes/test_formats.py",
    "tests/viewer/test_forked_windows.py",
    "tests/interop/test_pyrender_pictures.py",
    "tests/cli/test_streams.py",
    "tests/pictures/test_forest_frames.py",
    "tests/cli/test_doctor.py",
    "tests/passes/test_reuse.py",
    "tests/capture/test_swept_captures.py",
    "tests/lab/test_trade.py",
)
"""Files that take longest, in turn one that waits for windows or processes and one that computes.

They begin first: a long file that begins last would leave the other workers without work.
"""


def pytest_collection_modifyitems(config, items):
    """All workers must have the tests in one order: long files first, then by path."""
    if hasattr(config, "workerinput"):
        places = {config.rootpath / name: place for place, name in enumerate(LONG_FILES)}
        items.sort(key=lambda item: (places.get(item.path, len(places)), item.path))


def _number_of_worker(config):
    """0, 1 and so on; 0 without workers."""
    return int(getattr(config, "workerinput", {"workerid": "gw0"})["workerid"].removeprefix("gw"))


def pytest_collection_finish():
    """Keep garbage collections from going through all imported modules and collected tests again."""
    gc.collect()
    gc.freeze()


@pytest.fixture(scope="session")
def device():
    """A real OpenGL context (Mesa's llvmpipe through EGL where there is no GPU)."""
    made = Device()
    yield made
    made.release()


@pytest.fixture(scope="module")
def maker():
    """The script models/make_models.py as a module."""
    before = list(sys.path)
    sys.path.insert(0, str(asset_dir("models")))
    try:
        yield importlib.import_module("make_models")
    finally:
        sys.path[:] = before


@pytest.fixture
def render():
    """``render(scene, settings=..., size=..., outputs=..., time=...)`` gives a Frame that is drawn whole."""

    def draw(scene, settings=None, size=(64, 48), outputs=("color",), time=0.0, **options):
        with borrow_renderer(size, settings, **options) as renderer:
            return renderer.render(scene, time, outputs)

    return draw


def make_renderer(size=(64, 48), settings=None, **options):
    """A Renderer without the warning about drawing on the CPU, which tests do on purpose."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SoftwareDriverWarning)
        return Renderer(size, settings, **options)


_idle: dict[tuple, list[Renderer]] = {}
"""Renderers that are not lent, by their options."""


@contextmanager
def borrow_renderer(size=(64, 48), settings=None, **options):
    """A Renderer that the tests of a module use one after the other, so that it compiles a shader once.

    It draws every pass of every frame anew unless `reuse` is given, and is closed after an error.
    """
    options = {"reuse": False, "count_fragments": False} | options
    idle = _idle.setdefault(tuple(sorted(options.items())), [])
    if not idle:
        idle.append(make_renderer(size, settings, **options))
    renderer = idle.pop()
    try:
        renderer.settings = settings or Settings()
        renderer.reuse, renderer.count_fragments = options["reuse"], options["count_fragments"]
        renderer.resize(size)
        yield renderer
    except BaseException:
        renderer.close()
        raise
    idle.append(renderer)


@pytest.fixture(scope="module", autouse=True)
def close_renderers():
    """Close the renderers of `borrow_renderer` at a module's end."""
    yield
    while _idle:
        for renderer in _idle.popitem()[1]:
            renderer.close()
