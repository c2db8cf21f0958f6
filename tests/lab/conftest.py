"""The bench of experiments, shared by the tests of a module."""

import warnings

import pytest

from firefly_sample import SoftwareDriverWarning
from firefly_sample.lab.experiments.bench import ExperimentBench


@pytest.fixture(scope="module")
def bench():
    with ExperimentBench() as made:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", SoftwareDriverWarning)
            made.renderer  # noqa: B018 - made here, where its warning is expected
        yield made
