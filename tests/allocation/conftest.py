"""What several tests of the online allocator in C call."""

import online_allocator as oa
import pytest
from online_answers import PLAIN


@pytest.fixture(scope="module")
def thrusters():
    """Return the allocator of the twelve thrusters, set up."""
    allocator = oa.Allocator(12, 3, 3, 8)
    assert allocator.setup(*PLAIN) == oa.OPTIMAL
    return allocator
