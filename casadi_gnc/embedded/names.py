"""Names that generated C may carry: identifiers, and no word of C or C++."""

from __future__ import annotations

import re

from casadi_gnc.errors import PackageError

_C = """auto break case char const continue default do double else enum extern float for goto if inline int long
register restrict return short signed sizeof static struct switch typedef union unsigned void volatile while
_Bool _Complex _Imaginary _Alignas _Alignof _Atomic _Generic _Noreturn _Static_assert _Thread_local"""
_CPP = """alignas alignof and and_eq asm bitand bitor bool catch char8_t char16_t char32_t class co_await co_return
co_yield compl concept consteval constexpr constinit const_cast decltype delete dynamic_cast explicit export false
friend mutable namespace new noexcept not not_eq nullptr operator or or_eq private protected public
reinterpret_cast requires static_assert static_cast template this thread_local throw true try typeid typename
using virtual wchar_t xor xor_eq"""
#: Longest name that is taken; longer ones are appended to it.
LONGEST = 31
#: Words that no name may be.
RESERVED = frozenset((_C + " " + _CPP).split())


def check_name(name: str, what: str = "name") -> str:
    """Return a name that C and C++ accept.

    Raises
    ------
    PackageError
        If it is no identifier, a keyword, reserved by the language (a leading underscore), or too long.
    """
    if not re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]*", name):
        raise PackageError(f"the {what} {name!r} is no C identifier; use letters, digits and underscores")
    if name in RESERVED:
        raise PackageError(f"the {what} {name!r} is a keyword of C or C++; choose another")
    if name.startswith("_") or "__" in name:
        raise PackageError(f"the {what} {name!r} is reserved for the compiler by its underscores; choose another")
    if len(name) > LONGEST:
        raise PackageError(f"the {what} {name!r} is longer than {LONGEST} characters; choose a shorter one")
    return name
