"""First pictures for tests of caches: in a fresh process, and in this one."""

from __future__ import annotations

import json
import subprocess
import sys
import warnings

from firefly_sample import SoftwareDriverWarning
from firefly_sample.disk_cache import VARIABLE
from firefly_sample.lab.start_process import first_picture
from tests.cli.command import environment

SIZE = [48, 36]


def answer(scene, **variables):
    """The answer of a fresh process that draws a picture, and what else it said."""
    job = json.dumps({"scene": scene, "size": SIZE, "time": 5.0, "device": None})
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-m", "firefly_sample.lab.start_process", job],
        env=environment(**variables),
        capture_output=True,
        text=True,
        timeout=600,
        check=True,
    )
    return json.loads(done.stdout), done.stderr


def picture(scene, folder):
    """The digest of a picture that a fresh process draws."""
    told, said = answer(scene, **{VARIABLE: str(folder)})
    assert said == ""
    return told["sha256"]


def picture_here(scene):
    """The digest of a picture that this process draws, which keeps no model."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SoftwareDriverWarning)
        return first_picture(scene, SIZE, 5.0, None)["sha256"]
