"""Workers that differ: each is refused by its name, and the others draw the same bytes.

The tests of this module share a cluster and follow each other: the last ones end it.
"""

from __future__ import annotations

import logging
import shutil
import socket
import warnings
from collections.abc import Iterator
from pathlib import Path

import pytest

from firefly_sample.capture.cluster import ClusterEngine
from firefly_sample.capture.drawing import Failed
from firefly_sample.capture.job import Driver, Job, Task
from firefly_sample.errors import FireflyError, GpuError
from firefly_sample.model.cached import sha256_of
from tests.capture.clusters import Processes, draw_all, draw_here, job_of, with_version, without_package

distributed = pytest.importorskip("distributed")
pytestmark = pytest.mark.filterwarnings("ignore::firefly_sample.SoftwareDriverWarning")
