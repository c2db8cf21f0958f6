"""Run a function of a GLSL include over rows of numbers on the real driver.

`firefly_sample.lab.probes.probe`.
"""

from firefly_sample.lab.probes.probe import evaluate

__all__ = ["evaluate"]
