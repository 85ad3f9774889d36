"""The time that the scripts of this folder tell."""

import time
from collections.abc import Callable


def shortest(run: Callable[[], object], times: int = 7) -> float:
    """Return the least processor time of several runs [s]: other work on the machine must not favour short ones."""
    spent = []
    for _ in range(times):
        start = time.process_time()
        run()
        spent.append(time.process_time() - start)
    return min(spent)
