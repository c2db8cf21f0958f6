"""The names that `firefly_sample.lab` offers."""

import subprocess
import sys

import pytest

from firefly_sample import lab


def test_every_public_name_is_there():
    assert lab.__all__ == sorted(lab.__all__)
    assert set(lab.__all__) <= set(dir(lab))
    for name in lab.__all__:
        assert getattr(lab, name).__name__ == name
    with pytest.raises(AttributeError, match="has no attribute 'measure_luck'"):
        lab.measure_luck  # noqa: B018


def test_nothing_is_imported_before_it_is_used():
    code = (
        "import sys, firefly_sample.lab\n"
        "print([name for name in sys.modules if 'lab.' in name], 'numpy' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[] False\n"
