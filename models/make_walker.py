"""Makes walker.glb, a figure that walks on the spot: `python models/make_walker.py [FILE]`."""

from __future__ import annotations

import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE)]

from builder.walker import walker  # noqa: E402


def make(path: Path) -> Path:
    """Write the file and return its path."""
    path.write_bytes(walker().glb())
    return path


if __name__ == "__main__":
    made = make(Path(sys.argv[1]) if len(sys.argv) > 1 else HERE / "walker.glb")
    print(f"{made}: {made.stat().st_size / 1e3:.1f} kB")
