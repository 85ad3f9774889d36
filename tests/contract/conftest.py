"""Let the contract tests share which missions they run over."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
