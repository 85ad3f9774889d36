"""Let the contract tests share missions and back ends."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
