"""Makes every .glb file: `python models/make_models.py [FOLDER] [NAME ...]`.

Everything is computed here from fixed seeds; no picture or mesh comes from elsewhere. The arrays and
the decoded pixels are equal whenever they are made, and on any processor. FOLDER is this one when absent.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent)]

from builder.catalogue import MODELS, SHOWPIECES  # noqa: E402
from builder.export import write_glb  # noqa: E402


def make(folder: Path, names: tuple[str, ...] = ()) -> dict[str, Path]:
    """Write the models called `names` (all, when none are given) into `folder`; returns their paths."""
    folder.mkdir(parents=True, exist_ok=True)
    written = {}
    for name in names or (*MODELS, *SHOWPIECES):
        written[name] = folder / f"{name}.glb"
        if name in SHOWPIECES:
            written[name].write_bytes(SHOWPIECES[name]().glb())
        else:
            write_glb(written[name], MODELS[name]())
    return written


def main(arguments: list[str]) -> int:
    folder = Path(arguments[0]) if arguments else HERE
    known = (*MODELS, *SHOWPIECES)
    unknown = [name for name in arguments[1:] if name not in known]
    if unknown:
        print(f"no model {unknown[0]!r}: there are {', '.join(known)}", file=sys.stderr)
        return 2
    for name in arguments[1:] or known:
        start = time.perf_counter()
        path = make(folder, (name,))[name]
        print(f"{path.name:20} {path.stat().st_size / 1e6:6.2f} MB {time.perf_counter() - start:6.1f} s")
    return 0


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
