"""Panda3D's graphs and files as nodes of ours."""
