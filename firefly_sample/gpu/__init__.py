"""All OpenGL calls are in this folder and in `passes/`, nowhere else."""
