"""Problem files: find, check, build, change, sweep; missions, allocations and syntheses."""

from casadi_gnc.problem_files.allocation_file import load_allocation
from casadi_gnc.problem_files.by_name import check, fly, fly_all, mission_of
from casadi_gnc.problem_files.checking import check_file
from casadi_gnc.problem_files.document import Document, read, shipped
from casadi_gnc.problem_files.loading import load, load_document
from casadi_gnc.problem_files.sweeping import load_sweeps
from casadi_gnc.problem_files.synthesis_file import load_synthesis, synthesize
from casadi_gnc.problem_files.synthesis_recipes import Recipe

__all__ = [
    "Document",
    "Recipe",
    "check",
    "check_file",
    "fly",
    "fly_all",
    "load",
    "load_allocation",
    "load_document",
    "load_sweeps",
    "load_synthesis",
    "mission_of",
    "read",
    "shipped",
    "synthesize",
]
