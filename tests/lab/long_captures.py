"""A measurement of captures with a cluster: ``python -m pytest tests/lab/long_captures.py``."""

import pytest

from tests.lab.test_captures import WAYS, check_command


def test_the_command_measures_every_way(capsys, tmp_path, monkeypatch):
    pytest.importorskip("distributed")
    check_command(capsys, tmp_path, monkeypatch, WAYS)
