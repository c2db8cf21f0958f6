"""The window of ``firefly run``. Only the renderer calls OpenGL, and only `glfw_window` calls glfw."""
