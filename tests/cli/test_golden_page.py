"""The files of docs/golden.md, in a folder of their own, where pytest runs them with `-W error`."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import firefly_sample

ROOT = Path(firefly_sample.__file__).parents[1]
TAMPER = """
import numpy as np
import pytest
from pathlib import Path
from PIL import Image

options = ["-W", "error", "-p", "no:cacheprovider", "-q", "--tb=line"]
assert pytest.main([*options, "--update-golden"]) == 0

lamps = [f"golden/test_pictures.test_a_lamp_lights_a_card_{height}.png" for height in ("-0.5", "0.0", "0.5")]
within, beyond, missing = lamps
# two codes in all pixels and many in three of 3,072, which are less than 0.1 %; and then in four
pixels = np.array(Image.open(within))
pixels += np.where(pixels < 128, 2, -2).astype(np.uint8)
pixels[20, 30:33] ^= 128
Image.fromarray(pixels).save(within)
pixels = np.array(Image.open(beyond))
pixels[20, 30:34] ^= 128
Image.fromarray(pixels).save(beyond)
Path(missing).unlink()
assert pytest.main(options) == 1
"""


def test_the_golden_fixture_compares_by_two_limits(tmp_path):
    blocks = re.findall(r"```python\n(.*?)```", (ROOT / "docs" / "golden.md").read_text(), re.DOTALL)
    for name, block in zip(("conftest.py", "test_pictures.py"), blocks, strict=True):
        (tmp_path / name).write_text(block)
    done = subprocess.run(
        [sys.executable, "-c", TAMPER],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(ROOT), "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"},
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert "0.13% of the pixels are off by more than 2 codes" in done.stdout
    assert "card_0.5.png is missing: store it with --update-golden" in done.stdout
    assert "2 failed, 2 passed" in done.stdout
    (picture,) = (tmp_path / "differences").iterdir()
    assert picture.name == "test_pictures.test_a_lamp_lights_a_card_0.0.png"
