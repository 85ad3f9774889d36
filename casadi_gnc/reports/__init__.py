"""Pictures of flights and of checks."""
