"""Recipes: from a plant to certified gains, one file each."""

__all__: list[str] = []
