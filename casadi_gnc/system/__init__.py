"""The machine underneath: the files that are no Python, whole files, C compilers."""
