"""A printed controller says what its blocks compute and where the formula stands, by comments and nothing else."""

import dataclasses
import re

import casadi as ca

import casadi_gnc
from casadi_gnc.embedded import programs, saving
from casadi_gnc.embedded.controller import Options
from casadi_gnc.embedded.flight_function import flight_function
from casadi_gnc.embedded.function_source import function_files
from casadi_gnc.embedded.named_nodes import marks
from casadi_gnc.embedded.printer import print_function
from casadi_gnc.embedded.program_text import print_program
from casadi_gnc.embedded.scalars import graph
from casadi_gnc.embedded.source import render_source
from casadi_gnc.missions.onboard import describe


def code(text: str) -> str:
    """Return a C text without comments."""
    return re.sub(r"\s+", " ", re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL))


def test_blocks_are_named_at_no_cost_and_kept():
    controller = describe(casadi_gnc.load("huang2020/slew"), "funnel_pinv")
    text = render_source(controller, Options("slew"))
    plain = render_source(dataclasses.replace(controller, notes={}, marks={}), Options("slew"))
    assert code(text) == code(plain)
    assert render_source(saving.from_text(saving.to_text(controller)), Options("slew")) == text
    blocks = re.sub(r"\n\s+\* ", " ", text)
    assert "/* mrp: the measurement, or the last good one where it is not finite or out of range */" in blocks
    law = "casadi_gnc/laws/prescribed_performance.py"
    assert f"PrescribedPerformance.command in {law}: u_c0, (3,), [N m] (eq. 36)" in blocks
    assert f"PrescribedPerformance.rate in {law}: the rate of the memory (eqs 32, 38 and 39)" in blocks
    assert "    /* PerformanceFunnel.error in casadi_gnc/laws/performance_funnel.py again */" in blocks
    # What the law names on its way, in the order in which it is computed, each where it first stands.
    quantities = ("PerformanceFunnel.error", "RigidBody.gravity_gradient", "DisturbanceObserver.estimate")
    assert all(f"/* {each} in casadi_gnc/" in blocks for each in quantities)
    assert "PerformanceFunnel.spread in casadi_gnc/laws/performance_funnel.py: 1/r = ds/de" in blocks
    accepted = blocks[blocks.index("/* mrp: the measurement") :].partition("/* rate: the measurement")[0]
    assert accepted.count("input->mrp[") == 3
    assert "state->memory" not in accepted
    # Every statement of a step stands in a block.
    step = text[text.index("static void before(") : text.index("static void allocate(")]
    first = step.index("const gnc_")
    assert step.rindex("/*", 0, first) > 0
    assert not re.search(r"/\*", code(text))


def test_a_named_scalar_is_found_in_every_tape_that_computes_it():
    x, y, free = ca.SX.sym("x", 2), ca.SX.sym("y"), ca.SX.sym("free")
    angle = ca.atan2(x[0], x[1])
    first = ca.Function("first", [x], [ca.sin(angle) * 2], ["x"], ["carried"])
    handed = ca.SX.sym("carried")
    second = ca.Function("second", [handed, y], [3 - handed * y, y], ["carried", "y"], ["r", "s"])
    named = [("angle", angle), ("minus", -(ca.sin(angle) * 2 * y)), ("elsewhere", free * x)]
    found = marks({"first": first, "second": second}, named, {"x": x, "y": y})
    places = {name: [f"{name}[{i}]" for i in range(2)] for name in ("x", "y", "carried", "r", "s")}
    told = {
        name: [(title, [graph(tape, places)[0][k].code for k in nodes]) for title, nodes in found[name]]
        for name, tape in (("first", first), ("second", second))
    }
    assert told == {"first": [("angle", [ca.OP_ATAN2])], "second": [("minus", [ca.OP_MUL])]}


def test_few_lines_of_a_block_told_before_get_no_heading():
    x = ca.SX.sym("x", 3)
    one = ca.sin(x[0]) * ca.cos(x[1]) + ca.exp(x[2]) * x[0]
    tape = ca.Function("tape", [x], [ca.vertcat(one * one + 1, one * x[1], ca.sqrt(x[1]) * one)], ["x"], ["y"])
    nodes, results = graph(tape, {"x": ["x[0]", "x[1]", "x[2]"], "y": ["y[0]", "y[1]", "y[2]"]})
    named = next(k for k, node in enumerate(nodes) if node.code == ca.OP_ADD)
    titles = {"y[0]": "y: all", "y[1]": "y: all", "y[2]": "y: all"}
    text = print_function(tape, titles=titles, marks=[("one: the product", (named,))])
    plain = print_function(tape)
    assert code(text) == code(plain)
    headings = re.findall(r"/\* (.*) \*/\n(.*)", text)
    assert [heading for heading, _ in headings] == ["one: the product", "y: all"]
    assert f"const gnc_real a{named} =" in text.partition("/* y: all */")[0]
    assert len(results) == 3


def test_rounding_of_constants_is_shown():
    controller = describe(casadi_gnc.load("huang2020/detumble"), "damping_pinv")
    text = render_source(controller, Options("slew"))
    assert re.search(r"= 7\.5000000000000007e-05; /\* 7\.5e-05 and rounding \*/", text)
    assert re.search(r"e-1[78]; /\* rounding of zero, where other numbers are about 1 \*/", text)
    assert not re.search(r"= (0\.5|2\.|1000000000000\.); /\*", text)


def test_blocks_of_a_function_are_named_by_its_results():
    x, held = ca.MX.sym("x", 2), ca.MX.sym("held")
    sine = ca.Function("sine", [x], [ca.if_else(x[0] > 0, ca.sin(x[1]), 7.5000000000000007e-05)], ["x"], ["y"])
    law = ca.Function("law", [x, held], [2 * sine(x) - held, held + x[0]], ["x", "held"], ["u", "held_next"])
    ports = {"u": {"unit": "N m", "note": "torque */ asked for"}, "held": {"unit": "rad"}}
    own = flight_function(law, state={"held": "held_next"}, ports=ports, rate=100)
    text = function_files(own, Options("law"))["law.c"]
    assert "/* law: x0 is x, x1 is held, y0 is u, y1 is held_next */\nstatic void f_law(" in text
    assert "    /* u: torque * / asked for, (1, 1), [N m] */\n    const gnc_real" in text
    assert "    /* held_next: the next held, (1, 1), [rad] */" in text


def test_a_long_function_has_the_same_code_with_blocks():
    x = ca.SX.sym("x", 40)
    made = ca.Function("long", [x], [ca.cumsum(ca.sin(ca.mtimes(x, x.T)), 0), ca.sumsqr(x)], ["x"], ["y", "z"])
    program = programs.program(made, "long", lambda called: False, lambda function, k, place: programs.Callee(""))
    titles = {"y0": "y: many", "y1": "z: one"}
    text, plain = (print_program("long", program, titles=told) for told in (titles, {}))
    assert "_part2(" in plain
    assert "/*" not in plain
    assert code(text) == code(plain)
    assert "    /* y: many */" in text
    assert "    /* y again */" in text[text.index("_part2(") :]
    assert "    /* z: one */" in text
