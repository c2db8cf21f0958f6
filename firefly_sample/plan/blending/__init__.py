"""Blended surfaces: what is drawn over other surfaces, and in which order."""
