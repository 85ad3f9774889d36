"""Bad input: one clear sentence with file, line and key, and never a traceback of another kind."""

import re

import pytest

import casadi_gnc
from casadi_gnc.errors import ProblemError
from casadi_gnc.problem_files import toml_place
from casadi_gnc.problem_files.allocation_file import load_allocation
from casadi_gnc.problem_files.document import read, shipped
from casadi_gnc.problem_files.synthesis_file import load_synthesis

GOOD = read("huang2020/detumble").text
SLEW = read("huang2020/slew").text
DOCKING = read("shi2020/docking").text
WHEELS = read("huang2019/nominal").text
INERTIA = "[[0.49019, 0.0, 0.0], [0.0, 1.2089, 0.0], [0.0, 0.0, 1.2916]]"
ANGLES = "rotation_321_rad = [0.7853981633974483, 0.4487989505128276, 1.0471975511965976] # pi/4, pi/7, pi/3"
PRINTED = "rotation = [[0.63708, 0.63708, -0.43388], [-0.87855, 0.61925, 0.78026], [0.76577, -0.45897, 0.45048]]"

CASES = {
    "unknown key": (GOOD, "max_force_N", "max_forse_N", "line LINE, spacecraft.thrusters.max_forse_N: unknown key; did you mean max_force_N"),
    "unknown top key": (GOOD, 'kind = "mission"', 'kind = "mission"\nmood = 1', r"line \d+, mood: unknown key"),
    "unknown gain": (GOOD, "observer_gain = 27.0", "observer_gian = 27.0", r"scheme\[2\].law.observer_gian: unknown key; did you mean observer_gain"),
    "wrong shape": (GOOD, "centre_of_mass_m = [0.05, 0.05, 0.05]", "centre_of_mass_m = [0.05, 0.05]", "line LINE, spacecraft.centre_of_mass_m: has 2 entries, expected at least 3"),
    "inertia not spd": (GOOD, INERTIA, INERTIA.replace("1.2916", "-1.2916"), "line LINE, spacecraft.inertia_kg_m2: not positive definite: its smallest principal moment is -1.29"),
    "inertia not symmetric": (GOOD, INERTIA, INERTIA.replace("[0.49019, 0.0,", "[0.49019, 0.1,"), "not symmetric: .* up to 0.1 kg"),
    "inertia of no body": (GOOD, INERTIA, INERTIA.replace("1.2916", "3.2916"), "no body has these principal moments"),
    "the paper's rotation": (GOOD, ANGLES, PRINTED, r"line LINE, spacecraft.rotation: no rotation: the largest entry of R R' - I is 0.76, .*row 2 has length 1.328"),
    "reflection": (GOOD, ANGLES, "rotation = [[1,0,0],[0,1,0],[0,0,-1]]", "a reflection"),
    "two rotations": (GOOD, ANGLES, ANGLES + "\nrotation = [[1,0,0],[0,1,0],[0,0,1]]", "both given; keep one"),
    "negative bound": (GOOD, "max_force_N = 3.75e-3", "max_force_N = -1.0", "line LINE, spacecraft.thrusters.max_force_N: is -1.0, expected a number > 0"),
    "crossed bounds": (GOOD, "max_force_N = 3.75e-3", "max_force_N = 3.75e-3\nmin_force_N = 1.0", "min_force_N 1.0 exceeds max_force_N"),
    "not a number": (GOOD, "rate_rad_per_s = [0.45, 0.52, 0.55]", "rate_rad_per_s = [nan, 0.52, 0.55]", r"initial.rate_rad_per_s\[1\]: is nan, expected a finite number"),
    "infinite": (GOOD, "duration_s = 1500.0", "duration_s = inf", "timing.duration_s: is inf, expected a finite number"),
    "direction": (GOOD, "[0, 1, 0], [-1, 0, 0], [0, 0, 1],", "[0, 1, 0], [-1, 1, 0], [0, 0, 1],", "thruster 2: a direction of length 1.414"),
    "count": (GOOD, "  [0, 0, 1], [0, -1, 0], [1, 0, 0],\n", "", "12 positions but 9 directions"),
    "broken samples": (GOOD, "sample_period_s = 0.1", "sample_period_s = 0.7", "expected a whole number"),
    "wrong kind": (GOOD, 'kind = "mission"', 'kind = "voyage"', "kind is 'voyage'; this takes a file of kind \"mission\""),
    "no toml": (GOOD, "[truth]", "[truth", "line LINE: is not valid TOML: this line has a table whose name is not closed by ]"),
    "unknown law": (GOOD, 'type = "rate_damping"', 'type = "magic"', r"line LINE, scheme\[1\].law.type: no law 'magic'; there is rate_damping"),
    "negative gain": (GOOD, "rate_gain = 0.4 }", "rate_gain = -0.4 }", r"scheme\[1\].law.rate_gain: is -0.4, expected a number > 0"),
    "unknown erratum": (GOOD, 'feedback = "wanted"', 'feedback = "wanted"\nas_printed = ["typo"]', "detumble has no erratum 'typo'; known: anti_windup_sign"),
    "unknown signal": (GOOD, 'signal = "force"', 'signal = "forces"', r"metric\[4\].signal: 'forces' of the metric 'force_sample_sum' is no signal of scheme damping_pinv; did you mean 'force'\? There is time, mrp"),
    "same name": (GOOD, 'name = "observer_pinv"', 'name = "damping_pinv"', "the name 'damping_pinv' is given twice"),
    "name for a shell": (GOOD, 'name = "observer_pinv"', 'name = "a; rm -rf b"', r"scheme\[2\].name: is 'a; rm -rf b', expected a name of letters, digits and _"),
    "start outside funnel": (SLEW, "start = [0.40, 0.35, 0.15]", "start = [0.10, 0.35, 0.15]", "axis 1 starts at -0.206, outside its funnel from -0.1 to 0.01"),
    "inverted funnel": (SLEW, "floor = [5e-5, 5e-5, 5e-5]", "floor = [5e-5, 1, 5e-5]", "axis 2: floor 1 is wider than start 0.35"),
    "rate funnel": (SLEW, 'signal = "mrp"\nstart', 'signal = "rate"\nstart', r"needs a \[\[funnel\]\] on mrp, and the file has rate"),
    "text for a number": (GOOD, "max_force_N = 3.75e-3", 'max_force_N = "3.75e-3"', "line LINE, spacecraft.thrusters.max_force_N: is '3.75e-3', expected a number"),
    "truth for a number": (GOOD, "rate_gain = 0.4 }", "rate_gain = true }", "law.rate_gain: is true, expected a number"),
    "truth for the format": (GOOD, "format = 1", "format = true", "line LINE, format: format is true; this version reads format 1"),
    "other format": (GOOD, "format = 1", "format = 2", "format is 2; this version reads format 1"),
    "negative error box": (GOOD, "centre_of_mass_error_m = [5e-3,", "centre_of_mass_error_m = [-5e-3,", r"centre_of_mass_error_m\[1\]: is -0.005, expected a number >= 0"),
    "settling without threshold": (GOOD, "threshold = 2e-3\n", "", "settling and reaching, and nothing else, take a threshold"),
    "metric without kind": (GOOD, 'kind = "settling"\n', "", r"metric\[1\].kind: is missing; write one of 'settling', 'reaching', .*, 'sample_sum'$"),
    "name of a result file": (GOOD, 'name = "observer_pinv"', 'name = "comparison"', "cannot be named 'comparison'"),
    "inertia in other units": (GOOD, INERTIA, INERTIA.replace("0.49019", "1e200"), "no spacecraft's; look at the unit"),
    "endless": (GOOD, "duration_s = 1500.0", "duration_s = 1e308", "expected a whole number up to 1e9"),
    "incredible start": (GOOD, "rate_rad_per_s = [0.45,", "rate_rad_per_s = [45.0,", "line LINE, initial.rate_rad_per_s: 45 is beyond the largest credible rate, 10"),
    "deep nesting": (GOOD, "format = 1", "format = " + "[" * 3000, "is not valid TOML"),
    "endless digits": (GOOD, "duration_s = 1500.0", "duration_s = 1" + 4400 * "0", "line LINE: is not valid TOML: this line has a number of very many digits"),
    "gains that overflow inside": (DOCKING, "[-0.00016, 0.0, -0.42865,", "[1e308, 0.0, -0.42865,", r"scheme\[1\].law: IntermediateObserver cannot be made of these gains: they overflow, or leave a matrix without"),
    "thousands of wheels": (WHEELS, "axes = [", "axes = [" + 3000 * "[1, 0, 0], ", r"line LINE, spacecraft.wheels.axes: has 3004 entries, expected at most \d+$"),
    "one funnel": (SLEW, "[[funnel]]", "[funnel]", r"line LINE, funnel: there may be several funnels; write \[\[funnel\]\]"),
    "two funnels": (SLEW, "[timing]", SLEW[SLEW.index("[[funnel]]") : SLEW.index("[timing]")] + "[timing]", "'mrp' has two funnels"),
    "noise period": (GOOD, "[timing]", "[noise]\nperiod_s = 0.25\n\n[timing]", r"line 5\d, noise.period_s: period_s is 0.25, 2.5 times sample_period_s 0.1; expected a whole multiple"),
    "window of a settling": (GOOD, "threshold = ", "after_s = 3.0\nuntil_s = 2.0\nthreshold = ", "before after_s 3"),
    "no funnel": (SLEW, SLEW[SLEW.index("[[funnel]]") : SLEW.index("[timing]")], "", r"scheme\[2\].law: the law 'prescribed_performance' needs a \[\[funnel\]\] on mrp, and the file has none"),
}  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_bad_file_is_told_in_one_sentence(case, tmp_path):
    text, old, new, message = CASES[case]
    assert old in text
    path = tmp_path / "bad.toml"
    path.write_text(text.replace(old, new, 1))
    line = text[: text.index(old)].count("\n") + 1
    with pytest.raises(ProblemError) as caught:
        casadi_gnc.load(path)
    told = str(caught.value)
    assert re.search(message.replace("LINE", str(line)), told), told
    # One mistake is one line, but for what two schemes share.
    assert all(each.startswith("bad.toml") and len(each) < 400 for each in told.splitlines())
    assert len({each.split(": ", 1)[1] for each in told.splitlines()}) == 1


def test_unknown_key_names_the_near_one(tmp_path):
    path = tmp_path / "bad.toml"
    path.write_text(GOOD.replace("duration_s = 1500.0", "duration_s = 1500.0\nduration = 3"))
    with pytest.raises(ProblemError, match=r"line \d+, timing.duration: unknown key; did you mean duration_s\?"):
        casadi_gnc.load(path)


def test_missing_file_names_the_near_one():
    with pytest.raises(ProblemError, match='did you mean "huang2020/detumble"'):
        casadi_gnc.load("huang2020/detumbel")
    with pytest.raises(ProblemError, match="no problem file 'nowhere.toml'"):
        casadi_gnc.load("nowhere.toml")


def test_binary_file_is_told(tmp_path):
    path = tmp_path / "binary.toml"
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ProblemError, match="cannot be read as UTF-8"):
        casadi_gnc.load(path)


@pytest.mark.parametrize("name", shipped())
def test_shipped_problems_load(name):
    others = {"allocation": load_allocation, "synthesis": load_synthesis}
    kind = read(name).data["kind"]
    if kind in others:
        assert others[kind](name).title
    elif kind == "mission":
        mission = casadi_gnc.load(name, strict=False)
        assert mission.title
        assert "doi" in mission.source or name.startswith("satellites/")
        assert mission.craft.panels(mission)
    else:
        assert kind in ("claims", "benchmark"), kind  # read by the rooms above this one


def test_places_of_keys():
    places = toml_place.lines_of(GOOD)
    lines = GOOD.splitlines()
    assert lines[places["scheme", 1, "feedback"] - 1] == 'feedback = "wanted"'
    assert lines[places["scheme", 2, "law", "type"] - 1] == 'type = "detumble"'
    assert lines[places["metric", 3, "signal"] - 1] == 'signal = "force"'
    assert lines[places["environment", "harmonic", 1] - 1] == "[[environment.harmonic]]"


def test_composed_inertia_and_tables_of_parts(tmp_path):
    """A file may compose the inertia from parts (eq. 70) instead of giving it."""
    parts = "".join(
        f"[[spacecraft.part]]\nmass_kg = 10.0\ninertia_kg_m2 = [[0.2666,0,0],[0,0.26,0],[0,0,0.1666]]\n"
        f"position_m = [{x}, 0.0, 0.0]\n{ANGLES}\n"
        for x in (-0.2, 0.2)
    )
    text = GOOD.replace(f"inertia_kg_m2 = {INERTIA}\n", "", 1).replace(
        "[spacecraft.orbit_engine]", parts + "[spacecraft.orbit_engine]"
    )
    path = tmp_path / "parts.toml"
    path.write_text(text)
    inertia = casadi_gnc.load(path).scheme().law.body.inertia
    assert float(inertia[0, 0]) == pytest.approx(0.490189, abs=1e-5)  # eq. (70) without links, evaluated independently
    path.write_text(GOOD.replace("[spacecraft.orbit_engine]", parts + "[spacecraft.orbit_engine]"))
    with pytest.raises(ProblemError, match="either inertia_kg_m2 or one or more"):
        casadi_gnc.load(path)


def test_keys_in_strings_of_several_lines_are_no_keys(tmp_path):
    text = GOOD.replace('title = "De-tumbling a captured CubeSat"', 'title = """\n[timing]\nduration_s = 3\n"""')
    path = tmp_path / "quoted.toml"
    path.write_text(text.replace("duration_s = 1500.0", "duration_s = -1"))
    line = path.read_text().splitlines().index("duration_s = -1") + 1
    with pytest.raises(ProblemError, match=f"line {line}, timing.duration_s"):
        casadi_gnc.load(path)
    assert toml_place.lines_of("['timing'] # here\n'sample' . 'period' = 1") == {
        ("timing",): 1,
        ("timing", "sample", "period"): 2,
    }


def test_thrusters_that_leave_an_axis_out_are_refused(tmp_path):
    directions = GOOD[GOOD.index("directions = [") : GOOD.index("max_force_N")]
    path = tmp_path / "plane.toml"
    path.write_text(GOOD.replace(directions, "directions = [" + "[0, 0, 1], " * 12 + "]\n"))
    with pytest.raises(ProblemError, match="make no torque about some axis"):
        casadi_gnc.load(path)


@pytest.mark.parametrize("name", ["", "\0", "x" * 5000])
def test_names_that_are_no_files(name):
    with pytest.raises(ProblemError, match="names no file|no problem file"):
        casadi_gnc.load(name)


def test_lists_of_a_synthesis_are_not_empty(tmp_path):
    text = read("shi2020/synthesis").text
    path = tmp_path / "bad.toml"
    path.write_text(re.sub(r"half_widths = \[.*?\]", "half_widths = []", text))
    line = text[: text.index("half_widths = ")].count("\n") + 1
    with pytest.raises(ProblemError, match=f"bad.toml, line {line}, recipe.half_widths: has 0 entries, expected at l"):
        load_synthesis(path)
