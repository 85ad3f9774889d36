"""What every target keeps, whoever wrote it: the words of the host."""

from __future__ import annotations

from typing import Any

from casadi_gnc.delivery.packaging import generate
from casadi_gnc.delivery.verifying import verify
from casadi_gnc.embedded import boards
from casadi_gnc.system.folders import workshop
from casadi_gnc.testing.asserting import must


def check_target(target: Any, problem: Any = "huang2020/detumble", steps: int = 100) -> dict[str, Any]:
    """Test a target, by its name, its file or itself: a package's words there are those of the host.

    Returns what `verify` measured there: instructions, stack, sizes.

    Raises
    ------
    ContractError, TargetError
        Saying what is not kept, or which tool is missing.
    """
    board = boards.find(target)
    board.need()
    with workshop() as shop:
        folder = shop / "package"
        generate(problem, folder, scheme=None, name="contract", steps=steps)
        found = verify(folder, (board,))
    must(found["words"] == 0, f"{board.name}: {found['words']} words differ from those of the host")
    (measured,) = found["targets"]
    must(measured["instructions_median"] > 0, f"{board.name} counts no instructions")
    return measured
