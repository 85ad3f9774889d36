"""Printed numbers of papers beside ours, with verdicts that are computed."""

from casadi_gnc.fidelity.answering import answer
from casadi_gnc.fidelity.claims import papers, read_claims
from casadi_gnc.fidelity.report import PaperReport
from casadi_gnc.fidelity.verdict import Answer, Verdict

__all__ = ["Answer", "PaperReport", "Verdict", "answer", "papers", "read_claims"]
