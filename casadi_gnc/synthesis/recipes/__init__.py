"""Recipes: from a plant to certified gains, one file each."""
