"""Sequences of frames: rendered, written to files, and described by a manifest."""

import logging

# only programs that configure logging see messages; Python itself would print warnings
logging.getLogger("firefly_sample").addHandler(logging.NullHandler())
