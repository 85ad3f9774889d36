"""Names that generated C may carry: identifiers that clash with nothing of C, its libraries and the builds."""

from __future__ import annotations

import re

from casadi_gnc.embedded import standard_names as standard
from casadi_gnc.errors import PackageError

#: Longest name that is taken; longer ones are appended to it.
LONGEST = 31
#: Members that the parameters of a package, or a table of them, have beside its tunable gains.
_MEMBERS = ("derived", "configured", "allocation", "checksum", "changes")


def check_name(name: str, what: str = "name") -> str:
    """Return a name that C and C++ accept.

    Raises
    ------
    PackageError
        If it is no identifier, a keyword, reserved by the language (a leading underscore), a macro of the standard
        headers, or too long.
    """
    if not re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]*", name):
        raise PackageError(f"the {what} {name!r} is no C identifier; use letters, digits and underscores")
    if name in standard.KEYWORDS:
        raise PackageError(f"the {what} {name!r} is a keyword of C or C++; choose another")
    if name.startswith("_") or "__" in name:
        raise PackageError(f"the {what} {name!r} is reserved for the compiler by its underscores; choose another")
    if name in standard.MACROS:
        raise PackageError(f"the {what} {name!r} is a macro of C's headers or compilers; choose another")
    if len(name) > LONGEST:
        raise PackageError(f"the {what} {name!r} is longer than {LONGEST} characters; choose a shorter one")
    return name


def check_parameter(name: str) -> str:
    """Return the name of a tunable gain; raise `PackageError` as `check_name`, and if a package's own member has it."""
    if name in _MEMBERS:
        raise PackageError(f"the parameter {name!r} has the name of a member that packages have; choose another")
    return check_name(name, "parameter")


def check_package(name: str) -> str:
    """Return the name of a package: prefix of its symbols and macros, name of its files and of its CMake target.

    Raises
    ------
    PackageError
        As `check_name`, and for a name under which the package would not build, hide a header or a function of C,
        or clash with the files and symbols of the runtime or of another package.
    """
    check_name(name)

    def refuse(reason: str) -> PackageError:
        return PackageError(f"the name {name!r} {reason}; choose another with --name")

    if name != name.lower():
        raise PackageError(
            f"the name {name!r} has capital letters: its macros, and on some systems its files, would be those of "
            f"{name.lower()!r}; take --name {name.lower()}"
        )
    if name.endswith("_"):
        raise refuse("ends with an underscore: symbols such as " + repr(name + "_init") + " are reserved in C++")
    if name in standard.HEADERS or name.endswith("intrin"):
        raise refuse(f"would hide the system's header <{name}.h>")
    if name in standard.FUNCTIONS or name in standard.PREFIXES or name.endswith("_t"):
        raise refuse("belongs to the library of C or POSIX")
    if name == "gnc" or name.startswith("gnc_"):
        raise refuse("belongs to the runtime of every package (gnc_math.h, gnc_allocate.h)")
    if re.search(r"_alloc(ate)?(_|$)", name):
        owner = re.split(r"_alloc(?:ate)?(?:_|$)", name)[0]
        raise refuse(f"belongs to the allocator of a package {owner!r}")
    if name.endswith("_monitor"):
        raise refuse(f"belongs to the monitor of a package {name.removesuffix('_monitor')!r}")
    if name in standard.BUILDS or name == "replay" or name.startswith("replay_"):
        raise refuse("is taken in the package's own builds (CMake, make, test/replay.c)")
    if re.fullmatch(r"con|prn|aux|nul|(com|lpt)\d", name):
        raise refuse("is a device on Windows, where no file can be called so")
    return name
