"""Campaigns: many dispersed flights, and what follows from them."""
