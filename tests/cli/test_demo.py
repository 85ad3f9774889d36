"""What a newcomer with only the wheel does first."""

import os
import subprocess
import sys

from casadi_gnc.problem_files.document import locate


def test_demo_makes_a_page_and_keeps_what_was_changed(tmp_path):
    def demo():
        command = [sys.executable, "-m", "casadi_gnc.cli.main", "demo"]
        env = {**os.environ, "COLUMNS": "120"}
        return subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, timeout=300, env=env)

    problem = tmp_path / "demo" / "slew.toml"
    problem.parent.mkdir()
    text = locate("huang2020/slew").read_text(encoding="utf-8")
    problem.write_text(text.replace("duration_s = 1000.0", "duration_s = 30.0"), encoding="utf-8")
    changed = problem.read_text(encoding="utf-8")
    assert changed != text
    done = demo()
    assert done.returncode == 0, done.stderr
    assert (
        "look at demo/report.html in a browser; change demo/slew.toml, then: casadi-gnc fly demo/slew.toml"
        in done.stdout
    )
    page = (tmp_path / "demo" / "report.html").read_text(encoding="utf-8")
    assert "3 schemes flew for 30 s" in page
    assert problem.read_text(encoding="utf-8") == changed
