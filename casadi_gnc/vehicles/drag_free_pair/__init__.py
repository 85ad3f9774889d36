"""A satellite around a free-falling test mass."""
