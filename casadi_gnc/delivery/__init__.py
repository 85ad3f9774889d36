"""Hand a controller on: flight packages, their vectors and verification, mock-up units."""
