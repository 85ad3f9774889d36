"""Let the tests of pages share what runs a page."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
