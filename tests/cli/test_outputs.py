"""What `--json` prints, held against the schemas that `casadi-gnc schema --output` prints."""

import json
import os
import subprocess
import sys

import jsonschema
import pytest
import typer
from typer.testing import CliRunner

from casadi_gnc.cli import outputs
from casadi_gnc.cli.commands import app

DISPERSED = """
[[requirement]]
id = "ACS-1"
text = "little torque"
metric = "torque_sample_sum"
at_most = 1e6
share = 0.5
confidence = 0.9

[[dispersion]]
key = "initial.rate_rad_per_s.*"
uniform = [-0.05, 0.05]
"""
SWEPT = '\n[[sweep]]\nname = "drift"\nkey = "scheme.*.law.rate_gain"\nvalues = [0.01, 0.02]\nshow = "settling_time"\n'


def holds(command: str, text: str) -> None:
    jsonschema.validate(json.loads(text), outputs.schema(command), jsonschema.Draft202012Validator)


def test_every_command_with_json_has_a_schema_and_every_schema_a_command():
    group = typer.main.get_command(app)
    names = set()
    for name, command in group.commands.items():
        for inner, one in getattr(command, "commands", {"": command}).items():
            if any(part.name == "json" for part in one.params):
                names.add(f"{name} {inner}".strip())
    contests = {f"bench {name}" for name in ("allocation", "synthesis", "step", "flight", "report")}
    described = {name.split(" (")[0].replace(" --stream", "") for name in outputs.OUTPUTS} - {"problems"}
    assert names - contests == described - {"bench"}
    for name in outputs.OUTPUTS:
        found = outputs.schema(name)
        jsonschema.Draft202012Validator.check_schema(found)
        assert found["title"] == f"casadi-gnc {name} --json"


def test_a_key_that_is_not_named_is_refused():
    with pytest.raises(jsonschema.ValidationError, match="more"):
        holds("new", '{"wrote": [], "more": 1}')
    with pytest.raises(jsonschema.ValidationError, match="required"):
        holds("doctor", "{}")


@pytest.mark.parametrize(
    ("command", "words"),
    [
        ("crafts", ("crafts", "--show", "satellite")),
        ("laws", ("laws", "--show", "modes")),
        ("doctor", ("doctor",)),
        ("problems", ("problems",)),
    ],
)
def test_lists_keep_their_schema(command, words):
    holds(command, CliRunner().invoke(app, [*words, "--json"]).output)


def test_the_schema_of_an_output_is_printed_and_a_wrong_name_is_told():
    shown = CliRunner().invoke(app, ["schema", "--output", "fly"]).output
    assert json.loads(shown) == outputs.schema("fly")
    wrong = CliRunner().invoke(app, ["schema", "--output", "fli"])
    assert "no output of 'fli'; did you mean 'fly'?" in str(wrong.exception)


@pytest.mark.slow
def test_what_each_command_prints_keeps_its_schema(tmp_path):
    """One short mission through all of them."""

    def run(*words: str, given: str | None = None, codes=(0,)) -> str:
        command = [sys.executable, "-m", "casadi_gnc.cli.main", *words, "--json"]
        environment = {**os.environ, "COLUMNS": "120"}
        done = subprocess.run(command, capture_output=True, text=True, input=given, cwd=tmp_path, env=environment)
        assert done.returncode in codes, done.stderr
        return done.stdout

    holds("problems copy", run("problems", "copy", "huang2020/detumble", "."))
    mission = tmp_path / "detumble.toml"
    text = mission.read_text().replace("duration_s = 1500.0", "duration_s = 20.0")
    mission.write_text(text + DISPERSED)
    (tmp_path / "swept.toml").write_text(text + SWEPT)
    (tmp_path / "torques.csv").write_text("u1,u2,u3\n0.1,0.2,0.1\n")
    one = ("--scheme", "observer_pinv")
    holds("fly", run("fly", "detumble.toml", "--out", "out"))
    holds("fly (sweeps)", run("fly", "swept.toml", "--out", "swept", *one))
    holds("check", run("check", "detumble.toml", *one, codes=(0, 1)))
    holds("margins", run("margins", "detumble.toml", *one))
    holds("campaign", run("campaign", "detumble.toml", "--flights", "32", "--out", "mc"))
    falsified = ("--requirement", "ACS-1", "--flights", "32", "--out", "broken.toml")
    holds("falsify", run("falsify", "detumble.toml", *falsified, codes=(0, 1)))
    free = ("--free", "rate_gain", "--iterations", "1", "--out", "tuned.toml")
    holds("tune", run("tune", "detumble.toml", *one, *free, codes=(0, 1)))
    chosen = ("--flights", "4", "--plan", "corners")
    holds("campaign", run("campaign", "detumble.toml", *chosen, "--out", "corners"))
    holds("allocate", run("allocate", "huang2020/allocation", "--commands", "torques.csv", "--out", "f.csv"))
    for line in run("allocate", "huang2020/allocation", "--stream", given="0.1,0.2,0.1\nx\n").splitlines():
        holds("allocate --stream", line)
    holds("attainable", run("attainable", "huang2020/allocation", "--samples", "5"))
    holds("generate", run("generate", "detumble.toml", "--out", "flight", "--steps", "64"))
    holds("verify", run("verify", "flight"))
    holds("generate", run("generate", "detumble.toml", "--format", "fmu", "--out", "unit.fmu"))
    holds("report", run("report", "out", "--out", "page.html"))
    holds("new", run("new", "law", "MyLaw"))
    holds("bench", run("bench", "step", "detumble.toml", "--samples", "10", "--out", "bench"))
    holds("bench compare", run("bench", "compare", "bench", "bench"))
    holds("synthesize", run("synthesize", "shi2020/synthesis"))
