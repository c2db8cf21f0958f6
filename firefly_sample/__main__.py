"""``python -m firefly_sample`` is the command ``firefly``."""

import sys

from firefly_sample.cli import main

if __name__ == "__main__":
    sys.exit(main())
