"""Any text in any language means nothing but itself. Truth: compilers, parsers, a shell, make and CMake."""

import html.parser
import subprocess
import sys
import xml.etree.ElementTree as ElementTree

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from markdown_it import MarkdownIt

from casadi_gnc.system import text

#: Pieces that end comments and strings, join lines, or turn them around, beside single characters of all of Unicode.
PIECES = [
    "*/", "/*", "*", "/", "\\", "??/", "??", "\n", "\r", "\r\n", "\t", "\v", "\f", "\x85", "\u2028", "\u2029",
    "\x1b[2J", "\0",
    "\u202e", "\u2066", "\u2069", "\ufeff", "\ufffe", "\ud800", "\U000e0041", "'", '"', "<", ">", "&", "&#0;", "]]>",
    "<!--", "<script>", "`", "``", "|", "#", "$", "$(touch x)", "${x}", "%n", "//", "[a](b)", "![a](b)", "_", "~~",
    "---", "===", "1. ", "- ", "+ ", "> ", "@x@", ";", "word", " ",
]  # fmt: skip
TEXTS = st.lists(
    st.one_of(st.sampled_from(PIECES), st.characters(categories=None), st.text(max_size=3)), max_size=8
).map("".join)
MANY = st.lists(TEXTS, min_size=60, max_size=60)
SLOW = settings(max_examples=8, deadline=None, suppress_health_check=list(HealthCheck))
FAST = settings(max_examples=300, deadline=None)
C_LANGUAGES = [
    ("gcc", "-std=c99"),
    ("gcc", "-std=gnu11"),
    pytest.param(("g++", "-std=c++17"), marks=pytest.mark.tools("g++")),
    pytest.param(("clang", "-std=c99"), marks=pytest.mark.tools("clang")),
]


def run(*command, given=None):
    return subprocess.run([str(word) for word in command], input=given, capture_output=True, timeout=120)


@pytest.fixture(params=C_LANGUAGES, ids=" ".join)
def language(request):
    return [*request.param, "-trigraphs", "-Wall", "-Wextra", "-Werror"]


@SLOW
@given(texts=MANY)
def test_no_comment_ends_early(language, texts):
    """A comment a text, in every place that templates put one; an array after each says on which line it stands."""
    lines, expected = [], []
    for k, one in enumerate(texts):
        said = text.c_comment(one)
        for shape in (
            f"/* {said} */",
            f"/* SPDX\n *\n * {said}\n */",
            f"/* scheme {said}; do not edit. */",
            f"/*{said}*/",
        ):
            lines += shape.split("\n")
            lines.append(f"int a{len(expected)}[__LINE__ == {len(lines) + 1} ? 1 : -1];")
            expected.append(k)
    done = run(*language, "-x", "c++" if "++" in language[0] else "c", "-fsyntax-only", "-",
               given="\n".join(lines).encode())  # fmt: skip
    assert done.returncode == 0, done.stderr.decode()[:800]


@SLOW
@given(texts=MANY)
def test_strings_are_read_back(texts, tmp_path_factory):
    folder = tmp_path_factory.mktemp("c")
    body = "".join(f"  fwrite(s{k}, 1, sizeof s{k}, stdout);\n" for k in range(len(texts)))
    declared = "".join(f"static const char s{k}[] = {text.c_string(one)};\n" for k, one in enumerate(texts))
    (folder / "a.c").write_text(f"#include <stdio.h>\n{declared}int main(void) {{\n{body}  return 0;\n}}\n")
    done = run("gcc", "-std=c99", "-trigraphs", "-Wall", "-Werror", folder / "a.c", "-o", folder / "a")
    assert done.returncode == 0, done.stderr.decode()[:800]
    expected = b"".join(one.encode("utf-8", "backslashreplace") + b"\0" for one in texts)
    assert run(folder / "a").stdout == expected


@FAST
@given(one=TEXTS)
def test_xml_is_read_back(one):
    root = ElementTree.fromstring(f'<a b="{text.xml(one)}">{text.xml(one)}</a>'.encode())
    assert root.get("b") == root.text if one else not root.text
    assert root.get("b") == text.visible(one)


class Reader(html.parser.HTMLParser):
    """Collects what a reader of a page sees, and which tags there are."""

    def __init__(self):
        super().__init__()
        self.tags, self.values, self.said = [], [], ""

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self.values += [value for _, value in attrs]

    def handle_data(self, data):
        self.said += data


@FAST
@given(one=TEXTS)
def test_html_is_read_back(one):
    reader = Reader()
    reader.feed(f'<p title="{text.xml(one)}">{text.xml(one)}</p>')
    reader.close()
    assert reader.tags == ["p"]
    assert reader.said == text.visible(one)
    assert reader.values == [text.visible(one)]


def _flat(tokens):
    """Return kinds of all tokens, and the text that a reader sees."""
    kinds, said = [], ""
    for token in tokens:
        kinds.append(token.type)
        if token.type in ("text", "text_special"):
            said += token.content
        elif token.children:
            inner, more = _flat(token.children)
            kinds += inner
            said += more
    return kinds, said


@FAST
@given(one=TEXTS)
def test_markdown_is_read_back(one):
    """As a heading, a paragraph, a cell and an item: nothing but text in it."""
    seen, reader = text.line(one), MarkdownIt("commonmark").enable(["table", "strikethrough"])
    plain = {"text", "text_special", "inline"}
    for before, after, shape in (
        ("# ", "", {"heading_open", "heading_close"}),
        ("", "", {"paragraph_open", "paragraph_close"}),
        ("* about ", "", {"bullet_list_open", "bullet_list_close", "list_item_open", "list_item_close",
                          "paragraph_open", "paragraph_close"}),
    ):  # fmt: skip
        kinds, said = _flat(reader.parse(f"{before}{text.markdown(one)}{after}\n"))
        assert set(kinds) <= plain | shape, kinds
        assert " ".join(said.split()) == " ".join(f"{'about ' if 'about' in before else ''}{seen}".split())
    table = f"| a | b |\n|---|---|\n| {text.markdown(one)} | {text.markdown_code('x' + one)} |\n| last | row |\n"
    kinds, said = _flat(reader.parse(table))
    assert kinds.count("td_open") == 4
    assert said.endswith("lastrow")


@FAST
@given(one=TEXTS)
def test_code_of_markdown_is_read_back(one):
    rendered = MarkdownIt("commonmark").render(f"see {text.markdown_code(one)} there")
    reader = Reader()
    reader.feed(rendered)
    reader.close()
    assert reader.tags == ["p", "code"]
    assert " ".join(reader.said.split()) == " ".join(f"see {text.line(one)} there".split())


@SLOW
@given(texts=MANY)
def test_a_shell_reads_it_back(texts):
    texts = [one.replace("\0", "") for one in texts]  # no argument of a program can hold one
    words = " ".join(text.shell(one) for one in texts)
    done = run("bash", "-c", f"printf '%s\\0' {words}")
    assert done.returncode == 0, done.stderr
    assert "\n" not in words.replace("'\n'", "")
    expected = b"".join(
        one.encode("utf-8", "surrogateescape" if text._is_escaped(one) else "backslashreplace") + b"\0" for one in texts
    )
    assert done.stdout == expected


@SLOW
@given(texts=MANY)
def test_make_reads_it_back(texts, tmp_path_factory):
    """As a word of a list of files: one word, and no other rule, variable or comment."""
    folder = tmp_path_factory.mktemp("make")
    words = " ".join(text.make(f"w{one}") for one in texts)
    (folder / "Makefile").write_text(f"X = {words}\nY = last\nall:\n\t@echo '$(Y)'\n", encoding="utf-8", newline="\n")
    done = run("make", "-s", "-C", folder)
    assert done.returncode == 0, done.stderr
    assert done.stdout == b"last\n"


@SLOW
@given(texts=MANY)
def test_cmake_reads_it_back(texts, tmp_path_factory):
    folder = tmp_path_factory.mktemp("cmake")
    checks = "".join(
        f"set(A {text.cmake(one)})\nfile(APPEND {folder}/out \"${{A}}\\n\")\n" for one in texts
    )  # fmt: skip
    (folder / "a.cmake").write_text(checks, encoding="utf-8", newline="\n")
    done = run(sys.executable, "-c", "import cmake; cmake.cmake()", "-P", folder / "a.cmake")
    assert done.returncode == 0, done.stderr.decode()[:500]
    assert (folder / "out").read_text(encoding="utf-8").split("\n")[:-1] == [text.line(one) for one in texts]


@FAST
@given(one=TEXTS)
def test_a_terminal_is_left_alone(one):
    said = text.terminal(one)
    assert text.refused(said) is None
    assert all(character in "\t\n" or character.isprintable() or ord(character) >= 0xA0 for character in said)
    said.encode("utf-8")
    assert text.terminal(said) == said


@FAST
@given(one=TEXTS)
def test_a_picture_draws_it(one):
    from matplotlib.cbook import is_math_text

    assert not is_math_text(text.picture(one)) or "$" not in one


def test_what_is_refused_is_what_unicode_calls_so():
    """Truth: the tables of Unicode that come with Python."""
    import unicodedata

    for point in range(0x110000):
        character = chr(point)
        direction = unicodedata.bidirectional(character) in (
            "LRE",
            "RLE",
            "LRO",
            "RLO",
            "PDF",
            "LRI",
            "RLI",
            "FSI",
            "PDI",
        )
        control = unicodedata.category(character) in ("Cc", "Cs", "Zl", "Zp") and character not in "\t\n"
        if direction or control:
            assert text.refused(character), hex(point)
        if unicodedata.category(character)[0] in "LNPSM":
            assert text.refused(character) is None, hex(point)
