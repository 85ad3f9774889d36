"""Chaser and captured target, locked together by an arm, on the chaser's thrusters."""
