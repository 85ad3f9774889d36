"""Missions: problem files, the functions of a flight, engines, results."""
