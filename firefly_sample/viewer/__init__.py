"""The window and its controls. OpenGL is left to the renderer; only `glfw_window` knows glfw."""
