"""Run a function of a GLSL include over rows of numbers on the real driver.

See `firefly_sample.lab.probe.evaluate`.
"""

from firefly_sample.lab.probe import evaluate

__all__ = ["evaluate"]
