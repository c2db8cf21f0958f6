"""Runs a function of a GLSL include over rows of numbers, on the real driver: `firefly_sample.gpu.probe`."""

from firefly_sample.gpu.probe import evaluate

__all__ = ["evaluate"]
