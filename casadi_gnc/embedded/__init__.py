"""From tapes to C: the printer, compilers, compiled engines."""
