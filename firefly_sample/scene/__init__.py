"""The scene graph: nodes, geometry, lights, lenses and model files, in float64 and without any OpenGL."""
