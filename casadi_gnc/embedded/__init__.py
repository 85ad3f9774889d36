"""From tapes to C: the printer."""
