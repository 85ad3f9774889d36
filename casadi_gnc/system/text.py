"""Hand a text on in another language: C, XML, HTML, Markdown, Make, CMake, a shell line, a terminal, a picture.

Titles, sources, notes and names come from files that others wrote. Each function below returns a text that means
nothing but itself in its language, whatever the text is. Characters that no eye sees and that order a terminal, a
reader's eye or a parser about (`refused`) are written out, as `<U+202E>`; problem files that hold one are refused.
"""

from __future__ import annotations

import json
import re
import shlex
from collections.abc import Mapping

#: C0 but tab and newline, DEL, C1; line and paragraph separators; overrides, embeddings and isolates of the direction
#: of writing; interlinear annotation; the byte order mark; tags; halves of surrogate pairs; what is no character.
_REFUSED = re.compile(
    "[\x00-\x08\x0b-\x1f\x7f-\x9f\u2028\u2029\u202a-\u202e\u2066-\u2069\ufff9-\ufffb\ufeff"
    "\ud800-\udfff\ufdd0-\ufdef\U000e0000-\U000e007f"
    + "".join(f"{chr(0x10000 * plane + 0xFFFE)}{chr(0x10000 * plane + 0xFFFF)}" for plane in range(17))
    + "]"
)
_BREAKS = re.compile("[\t\n\v\f\r\x85\u2028\u2029 ]*[\t\n\v\f\r\x85\u2028\u2029][\t\n\v\f\r\x85\u2028\u2029 ]*")
_MARKDOWN = re.compile(r"[\\`*_\[\]<&|~$#]")
#: At the begin of a line these open a list, a quotation, a heading or a rule.
_MARKDOWN_START = re.compile(r"^([-+](?=[-+\s]|$)|[>=]|\d+(?=[.)]))")


def refused(text: str) -> str | None:
    """Return the first character that no text of a file may hold, as `U+202E`, or None.

    Examples
    --------
    >>> refused("de-tumbling, 10 Hz") is None
    True
    >>> refused("slew" + chr(13))
    'U+000D'
    """
    found = _REFUSED.search(text)
    return f"U+{ord(found[0]):04X}" if found else None


def visible(text: object) -> str:
    """Return a text in which such characters are written out; tabs and newlines stay.

    Examples
    --------
    >>> visible("slew" + chr(27) + "[2J")
    'slew<U+001B>[2J'
    """
    return _REFUSED.sub(lambda found: f"<U+{ord(found[0]):04X}>", str(text))


def line(text: object) -> str:
    """Return a text on one line: what ends a line, or is a tab, becomes one space."""
    return visible(_BREAKS.sub(" ", str(text))).strip()


def c_comment(text: object) -> str:
    r"""Return a text inside a C comment of one line: it neither ends nor opens one, nor joins its line to the next.

    A backslash (or the trigraph that is one) splices lines before comments are looked for.

    Examples
    --------
    >>> c_comment("gains */ of \n/* nobody")
    'gains * / of / * nobody'
    >>> print(c_comment("thrust" + chr(92)))
    thrust\ .
    """
    said = line(text).replace("??/", "? ?/").replace("*/", "* /").replace("/*", "/ *")
    if said.startswith("/"):
        said = f" {said}"
    return f"{said} ." if said.endswith(("\\", "*", "/")) else said


def c_string(text: object) -> str:
    r"""Return a C string literal whose value is the text in UTF-8, quotes included.

    Examples
    --------
    >>> print(c_string('50 % "off"??/' + chr(10)))
    "50 % \"off\"\?\?/\012"
    """
    return '"' + _in_octal(str(text).encode("utf-8", "backslashreplace"), escaped='"\\?') + '"'


def _in_octal(content: bytes, escaped: str) -> str:
    """Return bytes as printable ASCII: a backslash before characters that need it, octal codes for what has no form."""
    parts = []
    for byte in content:
        character = chr(byte)
        if character in escaped:
            parts.append(f"\\{character}")
        else:
            parts.append(character if 32 <= byte < 127 else f"\\{byte:03o}")
    return "".join(parts)


def xml(text: object) -> str:
    """Return a text as content or attribute of XML and HTML; it is read back as `visible(text)`.

    Examples
    --------
    >>> xml('a < "b"')
    'a &lt; &#34;b&#34;'
    """
    said = visible(text).replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")
    return said.replace('"', "&#34;").replace("'", "&#39;").replace("\n", "&#10;").replace("\t", "&#9;")


def json_in_html(content: object) -> str:
    r"""Return plain data as JSON that may stand in an element of HTML: nothing in it ends the element.

    Texts in it are read back as `visible(text)`, names of tables too. Raises `ValueError` for a number that JSON lacks.

    Examples
    --------
    >>> print(json_in_html(["</script>", "a" + chr(0x202E)]))
    ["\u003c/script\u003e","a\u003cU+202E\u003e"]
    """
    said = json.dumps(_all_visible(content), allow_nan=False, separators=(",", ":"))
    return said.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def _all_visible(content: object) -> object:
    if isinstance(content, str):
        return visible(content)
    if isinstance(content, Mapping):
        return {visible(key): _all_visible(each) for key, each in content.items()}
    return [_all_visible(each) for each in content] if isinstance(content, (list, tuple)) else content


def markdown(text: object) -> str:
    r"""Return a text on one line of Markdown, in a paragraph, a heading or a cell of a table.

    Examples
    --------
    >>> print(markdown("<b>|F| of A_0</b>"))
    \<b>\|F\| of A\_0\</b>
    """
    said = _MARKDOWN.sub(lambda found: f"\\{found[0]}", line(text))
    return _MARKDOWN_START.sub(lambda found: f"{found[0]}\\" if found[0].isdigit() else f"\\{found[0]}", said)


def markdown_code(text: object) -> str:
    """Return a text as a span of code in Markdown.

    Examples
    --------
    >>> markdown_code("funnel_pinv")
    '`funnel_pinv`'
    """
    said = line(text)
    if "|" in said or not said:  # a cell ends at a bar even in code
        return f"<code>{markdown(said)}</code>"
    fence = "`" * (max((len(run) for run in re.findall("`+", said)), default=0) + 1)
    padding = " " if said.startswith("`") or said.endswith("`") else ""
    return f"{fence}{padding}{said}{padding}{fence}"


def make(text: object) -> str:
    r"""Return a text as one word of a Makefile.

    Examples
    --------
    >>> print(make("a file$.c"))
    a\ file$$.c
    """
    return re.sub(r"([\s#:%\\])", r"\\\1", line(text)).replace("$", "$$")


def cmake(text: object) -> str:
    r"""Return a text as one argument in CMake; quoted where it is no plain word.

    Examples
    --------
    >>> print(cmake("slew.c"), cmake("a ${file}"))
    slew.c "a \${file}"
    """
    said = line(text)
    if re.fullmatch(r"[A-Za-z0-9_./-]+", said):
        return said
    return '"' + re.sub(r'([\\"$@])', r"\\\1", said) + '"'


def shell(text: object) -> str:
    """Return a text as one word of a shell line that a user may copy.

    Examples
    --------
    >>> print(shell("flight"), shell("my dir"))
    flight 'my dir'
    """
    said = str(text)
    if not _REFUSED.search(said) and "\n" not in said and "\t" not in said:
        return shlex.quote(said)
    content = said.encode("utf-8", "surrogateescape" if _is_escaped(said) else "backslashreplace")
    return "$'" + _in_octal(content, escaped="'\\") + "'"


def _is_escaped(text: str) -> bool:
    """Tell whether all halves of surrogate pairs stand for bytes of a file's name."""
    return all("\udc80" <= one <= "\udcff" for one in re.findall("[\ud800-\udfff]", text))


def terminal(text: object) -> str:
    """Return a text for a terminal: nothing in it moves the cursor, changes colours or turns the line around."""
    return visible(text)


def picture(text: object) -> str:
    """Return a text for a picture, in which a dollar sign would begin a formula."""
    return visible(text).replace("$", r"\$")
