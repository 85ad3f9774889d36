"""What a rare event is asked of: a margin of each case, which is not above zero where the case fails."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from casadi_gnc.errors import CampaignError

#: From cases in standard normal coordinates, (n, d), to their margins, (n,); a case fails where its margin is <= 0.
Margins = Callable[[np.ndarray], np.ndarray]


class Counted:
    """Ask for margins, check what comes, and count the cases."""

    def __init__(self, margins: Margins, dimensions: int) -> None:
        if dimensions < 1:
            raise CampaignError(f"a rare event in {dimensions} dimensions; expected 1 or more")
        self._margins = margins
        self.dimensions = dimensions
        self.flights = 0

    def __call__(self, points: np.ndarray) -> np.ndarray:
        """Return the margins of points (n, d), (n,); raise `CampaignError` where they are none."""
        found = np.asarray(self._margins(points), dtype=float)
        if found.shape != (len(points),):
            raise CampaignError(f"margins of shape {found.shape} for {len(points)} cases; expected one number each")
        if np.isnan(found).any():
            raise CampaignError(
                f"{int(np.isnan(found).sum())} of {len(points)} margins are no number; let what cannot be flown count "
                "as failed, with a margin of minus infinity"
            )
        self.flights += len(points)
        return found
