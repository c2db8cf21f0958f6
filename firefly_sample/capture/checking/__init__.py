"""Captures on disk, compared with their manifests and with each other."""
