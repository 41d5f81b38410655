"""What a play makes of a signal, sample by sample: no engine, and no block of nlctl."""

import numpy as np


def through_play(u, half_gap):
    """Return the outputs of a play that begins at 0, of inputs at dense times; shapes (n,)."""
    v = np.zeros_like(u)
    for i in range(1, u.size):
        v[i] = min(max(v[i - 1], u[i] - half_gap), u[i] + half_gap)
    return v
