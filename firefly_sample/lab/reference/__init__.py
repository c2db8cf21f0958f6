"""The float64 twins of the GLSL includes: each file here is held against the include of its name."""
