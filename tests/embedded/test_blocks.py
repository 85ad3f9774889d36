"""A printed controller says what its blocks compute and where the formula stands, by comments and nothing else."""

import dataclasses
import re

import casadi_gnc
from casadi_gnc.embedded import saving
from casadi_gnc.embedded.controller import Options
from casadi_gnc.embedded.source import render_source
from casadi_gnc.missions.onboard import describe


def code(text: str) -> str:
    """Return a C text without comments."""
    return re.sub(r"\s+", " ", re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL))


def test_blocks_are_named_at_no_cost_and_kept():
    controller = describe(casadi_gnc.load("huang2020/slew"), "funnel_pinv")
    text = render_source(controller, Options("slew"))
    plain = render_source(dataclasses.replace(controller, notes={}), Options("slew"))
    assert code(text) == code(plain)
    assert render_source(saving.from_text(saving.to_text(controller)), Options("slew")) == text
    blocks = re.sub(r"\n\s+\* ", " ", text)
    assert "/* mrp: the measurement, or the last good one where it is not finite or out of range */" in blocks
    law = "casadi_gnc/laws/prescribed_performance.py"
    assert f"PrescribedPerformance.command in {law}: u_c0, (3,), [N m] (eq. 36)" in blocks
    assert f"PrescribedPerformance.rate in {law}: the rate of the memory (eqs 32, 38 and 39)" in blocks
    assert "    /* status again */" in blocks
    # Every statement of a step stands in a block.
    step = text[text.index("static void before(") : text.index("static void allocate(")]
    first = step.index("const gnc_")
    assert step.rindex("/*", 0, first) > 0
    assert not re.search(r"/\*", code(text))


def test_rounding_of_constants_is_shown():
    controller = describe(casadi_gnc.load("huang2020/detumble"), "damping_pinv")
    text = render_source(controller, Options("slew"))
    assert re.search(r"= 7\.5000000000000007e-05; /\* 7\.5e-05 and rounding \*/", text)
    assert re.search(r"e-1[78]; /\* rounding of zero, where other numbers are about 1 \*/", text)
    assert not re.search(r"= (0\.5|2\.|1000000000000\.); /\*", text)
