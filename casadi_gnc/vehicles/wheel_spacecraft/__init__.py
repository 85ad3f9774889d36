"""A spacecraft on reaction wheels."""
