"""A mission whose flights follow by hand: a block of 1 kg on ice (tests/tuning/block.py), braked, sampled at 10 Hz."""

from pathlib import Path

BLOCK = Path(__file__).parents[1] / "tuning" / "block.py"
TEXT = """format = 1
kind = "mission"
title = "A block is braked"

[spacecraft]
model = "./block.py:BlockCraft"

[timing]
mode = "sampled"
sample_period_s = 0.1
duration_s = 5.0

[[scheme]]
name = "brake"
law = {{ type = "./block.py:Brake", brake_gain = {gain} }}

"""


def written(folder: Path, gain: float, rest: str) -> Path:
    """Write the mission with a gain [N s/m] and further tables, and its classes beside it; return the file."""
    (folder / "block.py").write_text(BLOCK.read_text(encoding="utf-8"), encoding="utf-8")
    (folder / "block.toml").write_text(TEXT.format(gain=gain) + rest, encoding="utf-8")
    return folder / "block.toml"
