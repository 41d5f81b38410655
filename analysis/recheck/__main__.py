"""``python -m nlctl.analysis.recheck FILE``."""

import sys

from . import main

if __name__ == "__main__":
    sys.exit(main())
