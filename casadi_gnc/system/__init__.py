"""The machine underneath: the files that are no Python, whole files, C compilers, texts that leave."""

from casadi_gnc.system import assets, compilers, files, text

__all__ = ["assets", "compilers", "files", "text"]
