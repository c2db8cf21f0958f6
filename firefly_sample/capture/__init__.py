"""Sequences of frames: rendered, written to files, and described by a manifest."""
