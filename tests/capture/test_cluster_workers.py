"""Workers that differ: each is refused by its name, and the others draw the same bytes.

The tests of this module share a cluster and follow each other: the last ones end it.
"""

from __future__ import annotations

import pytest

distributed = pytest.importorskip("distributed")
pytestmark = pytest.mark.filterwarnings("ignore::firefly_sample.SoftwareDriverWarning")
