"""Problem files: find, check, build, change, sweep; missions, allocations and syntheses."""
