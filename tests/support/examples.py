"""How many examples a property is tried on."""

import os


def many(examples):
    """Number of examples of a test of random programs: a fifth, but all of them once a week."""
    return examples if os.environ.get("ALL_EXAMPLES") else examples // 5
