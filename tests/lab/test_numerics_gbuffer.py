"""Formats of normals and colours, and the driver's conversions, against theory."""

from __future__ import annotations

import math

import numpy as np
import pytest

from firefly_sample.lab.experiments import TABLES
from firefly_sample.lab.experiments.experiment import EPS
from firefly_sample.lab.experiments.gbuffer import degrees_between, normal_bounds, stored_normals
from firefly_sample.srgb import linear_to_srgb
from tests.lab.bounds import holds_its_bounds


def test_normals(bench):
    table = TABLES["normals"].table(bench, samples=200_000)
    assert holds_its_bounds(table)
    for name, bound in normal_bounds().items():
        largest = math.radians(table.value(name, "max deg"))
        if name not in ("rgba16f", "rgba32f"):
            assert largest >= 0.9 * bound
            # the error of N.L is the chord of the angle
            assert table.value(name, "max N.L") == pytest.approx(2.0 * math.sin(0.5 * largest), rel=1e-4)
    for name, steps in (("rgba8", 255), ("rgb10a2", 1023)):
        # errors of +-1/steps in each coordinate, two thirds of whose squares lie across the normal
        rms = math.degrees(math.sqrt(2.0 / 3.0) / steps)
        assert 0.9 * rms <= table.value(name, "mean deg") <= rms
    assert table.value("oct16", "bytes") == table.value("rgba8", "bytes") == 4


def test_normals_of_any_length_have_an_angle(device):
    angle = np.radians([1e-6, 1e-3, 45.0, 90.0, 179.0, 180.0])
    a = np.tile([0.0, 0.0, 3.0], (len(angle), 1))
    b = 0.1 * np.stack([np.sin(angle), np.zeros_like(angle), np.cos(angle)], axis=1)
    assert degrees_between(a, b) == pytest.approx(np.degrees(angle), rel=1e-9)
    # the axes are exact on the octahedron
    axes = np.concatenate([np.eye(3), -np.eye(3)]).astype(np.float32)
    assert (stored_normals(device, axes, "rgba32f") == axes).all()
    if device.capabilities.snorm_targets:
        assert (stored_normals(device, axes, "oct16") == axes).all()


def test_albedo(bench):
    table = TABLES["albedo"].table(bench, samples=100_000)
    assert holds_its_bounds(table)
    for name in ("sqrt10", "sqrt8", "rgba8"):
        assert table.value(name, "at 0.01") >= 0.9 * table.value(name, "at 0.01 bound")
    for name, steps in (("sqrt10", 1023), ("sqrt8", 255)):
        root, half = np.linspace(0.0, 1.0, 100_000), 0.5 / steps
        expected = 255.0 * (linear_to_srgb((root + half) ** 2) - linear_to_srgb(root**2)).max()
        assert 0.9 * expected <= table.value(name, "codes") <= 1.001 * expected
    assert table.value("rgba8", "codes") == pytest.approx(0.5 * 12.92, rel=0.01)  # sRGB's slope at 0
    assert table.value("rgba32f", "codes") == table.value("rgba32f", "at 0.01") == 0.0


def test_conversions(bench):
    table = TABLES["conversions"].table(bench, samples=200_000)
    for name in ("rgba8", "rg16_snorm", "rgba16"):
        assert table.value(name, "steps") <= 0.5 + 65535 * EPS
        assert table.value(name, "not nearest") == 0.0
    if bench.device.software:  # what Mesa's llvmpipe does
        # floor(1024 x) is not the nearest of 1023 where x and the fraction of 1024 x are half apart
        assert table.value("rgb10_a2", "not nearest") == pytest.approx(0.25, abs=0.01)
        for name in ("rgba16f", "r11f_g11f_b10f"):
            assert table.value(name, "steps") <= 1.0
            assert table.value(name, "not nearest") == pytest.approx(0.5, abs=0.01)
        assert 0.05 < table.value("sRGB, encoding", "not nearest") < 0.08
        assert 1.0e-3 < table.value("sRGB, decoding", "absolute") < 1.3e-3
