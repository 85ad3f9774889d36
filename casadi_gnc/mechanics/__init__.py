"""Bodies and what moves them: attitude, rigid bodies, wheels, thrusters, dipoles, orbits, disturbances, faults."""
