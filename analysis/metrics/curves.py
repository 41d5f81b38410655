"""What samples say of a signal between them: where a curve may be put through them, and which.

A polynomial through samples says something only where the signal is smooth, and samples show where:
each should lie where its neighbours say.  With up to 8 neighbours the *defect* of a sample is

    r = y_k - p(t_k),     p the polynomial through the neighbours,

on even samples the eighth difference over 70: of order h^8 of a smooth signal, and of the first or
zeroth order next to a kink or a jump.  With R the largest |r| by three windows of neighbours, each
a sample further, the curve's extreme p* counts as p* - `_GUARD` R, and only where it is beyond the
sample by more than `_CLEAR` R.  So what is lost of a smooth peak is O(h^8), and a limiter's corner
is not overshot: a kink, wherever it lies, moves the polynomial by less than `_GUARD` R.
A largest or smallest value that three samples in a row have is a limit, and no curve goes beyond
it, not on the way to a break either.  What no sample has seen, such as a limit reached for less
than a sampling interval and nowhere else, samples alone cannot say; the estimate is then beyond it
by at most h^2 |y''| / 8.

*Breaks* are the times at which a signal may jump or bend.  No curve goes through one; the limits
from both sides, extrapolated from the samples of that side, are values of the signal as well.
"""

from __future__ import annotations

import numpy as np

from nlctl.equations import equation

from .integrals import consecutive_differences

_HALF = 4  # neighbours on each side that a curve goes through
_GUARD = 4.0
_CLEAR = 64.0
_ROUNDING = 1e-15  # of the values: no defect is known to be smaller
_NEAREST = 7  # samples from which a limit is extrapolated, at most
_APART = 1e-12  # of the time covered: by how much a path jumps before and after a break
_LINE = 2.5e-7  # of a signal's range: how far lines of a path may be from its curves
_PARTS = 32.0  # of an interval, at most
_ENDS = 17  # points from the last sample to a break


@equation
def largest_of(y):
    """Return the largest value, NaN if there is one; `numpy.max` calls what only numba has."""
    return y[np.argmax(y)]


@equation
def smallest_of(y):
    """Return the smallest value, see `largest_of`."""
    return y[np.argmin(y)]


@equation
def _pieces(t, breaks):
    """Return the pieces between breaks: first and last + 1 of their samples, start and end (s)."""
    # Samples at a break belong to no piece: they are values of their own, of one side or the other.
    span = t[-1] - t[0]
    near = max(1e-9 * span / t.size, 4 * _APART * span)
    inside = breaks[(breaks >= t[0] - near) & (breaks <= t[-1] + near)]
    n = inside.size
    first, last = np.zeros(n + 1, np.int64), np.full(n + 1, t.size)
    start, end = np.full(n + 1, t[0]), np.full(n + 1, t[-1])
    for i in range(n):  # one by one, here and below: slices take twice as long to compile
        first[i + 1] = np.searchsorted(t, inside[i] + near, "right")
        last[i] = np.searchsorted(t, inside[i] - near, "left")
        start[i + 1] = end[i] = inside[i]
    return first, np.maximum(last, first), start, end


@equation
def _around(size, k):
    """Return the samples [a, b) of a piece that say how far sample `k` may be believed."""
    a = min(max(k - _HALF - 1, 0), max(size - 2 * _HALF - 3, 0))
    return a, min(a + 2 * _HALF + 3, size)


@equation
def _coefficients(size):
    """Return how many coefficients curves through samples of a piece of five or more have."""
    return min(2 * _HALF + 1, max(size - 2, 4))


@equation
def _differences(t, y, count):
    """Return divided differences: f[t_i, ..., t_(i + m)], m < count, is `table[i, m]`."""
    # A row has the coefficients of Newton's form of the polynomial through a sample and the next.
    table = np.empty((t.size, count))
    for i in range(t.size):
        table[i, 0] = y[i]
    for m in range(1, count):
        for i in range(t.size - m):
            table[i, m] = (table[i + 1, m - 1] - table[i, m - 1]) / (t[i + m] - t[i])
    return table


@equation
def _window(table, k):
    """Return at which sample the curve around sample `k` begins."""
    size, count = table.shape
    return min(max(k - _HALF, 0), size - count)


@equation
def _doubt(t, y, table, k):
    """Return the largest defect of a sample by the samples of three windows, or rounding."""
    # Within a window it is the last divided difference times the distances to the others.
    size, count = table.shape
    begin = max(min(_window(table, k) - 1, size - count - 2), 0)
    doubt = 0.0
    for start in range(begin, min(begin + 3, size - count + 1)):
        end, largest = start + count, abs(y[k])
        defect = table[start, count - 1]
        for m in range(start, end):
            largest = max(largest, abs(y[m]))
            defect *= t[k] - t[m] if m != k else 1.0
        if not start <= k < end:  # next to an end of the piece
            defect = _at(t[start:end], table[start], t[k])[0] - table[k, 0]
        doubt = max(doubt, abs(defect), _ROUNDING * largest)
    return doubt


@equation
def _at(s, c, x):
    """Return the polynomial in Newton's form with its first and second derivative."""
    p, d, dd = c[-1], 0.0, 0.0
    for m in range(c.size - 2, -1, -1):
        dd = dd * (x - s[m]) + 2 * d
        d = d * (x - s[m]) + p
        p = p * (x - s[m]) + c[m]
    return p, d, dd


@equation
def _turn(t, y, k, low, high):
    """Return place and value of the extreme next to sample `k`, in [low, high], and if it is."""
    # The sample is the largest or the smallest of its neighbours in a piece.
    begin, end = _around(t.size, k)
    t, y, k = t[begin:end], y[begin:end], k - begin
    s, x = t - t[k], 0.0
    table = _differences(s, y - y[k], _coefficients(t.size))
    a = _window(table, k)
    c = table[a]
    for _ in range(5):  # Newton's method: quadratic from the sample
        _, d, dd = _at(s[a:], c, x)
        x = min(max(x - d / dd, low - t[k]), high - t[k]) if dd != 0.0 else 0.0
    gain, d, dd = _at(s[a:], c, x)
    doubt = _doubt(t, y, table, k)
    beyond = gain * (-1.0 if dd > 0.0 else 1.0)
    is_clear = beyond > _CLEAR * doubt  # NaN: not
    value = y[k] + np.sign(gain) * (abs(gain) - _GUARD * doubt) if is_clear else y[k]
    return t[k] + x, value, is_clear


@equation
def _held(y, value):
    """Whether three samples in a row have a value."""
    at = y == value
    return np.any(at[2:] & at[1:-1] & at[:-2])


@equation
def _limits(y):
    """Return below and above which no curve goes: -inf and inf where no value is held."""
    low, high = smallest_of(y), largest_of(y)
    return low if _held(y, low) else -np.inf, high if _held(y, high) else np.inf


@equation
def turning_points(t, y, breaks):
    """Return extremes between samples: before which sample each is, when, and its value."""
    # Shapes: `t, y` (n,), `breaks` (m,).
    place, value = np.empty(y.size), np.empty(y.size)
    before = np.zeros(y.size, np.int64)
    count = 0
    bottom, top = _limits(y)
    firsts, lasts, starts, ends = _pieces(t, breaks)
    for first, last, start, end in zip(firsts, lasts, starts, ends):  # noqa: B905 (numba)
        if last - first < 5:
            continue
        own_t, own_y, size = t[first:last], y[first:last], last - first
        d = consecutive_differences(own_y)
        up, down = np.concatenate((-d[:1], d)), np.concatenate((d, -d[-1:]))
        turns = ((up > 0) & (down <= 0)) | ((up < 0) & (down >= 0))
        for k in np.nonzero(turns)[0]:
            low = own_t[k - 1] if k > 0 else start
            high = own_t[k + 1] if k + 1 < size else end
            at, extreme, is_clear = _turn(own_t, own_y, k, low, high)
            is_clear &= bottom <= extreme <= top and (count == 0 or at > place[count - 1])
            if is_clear and at > low and at < high and at != own_t[k]:
                place[count], value[count] = at, extreme
                before[count] = first + k + (at > own_t[k])
                count += 1
    return before[:count], place[:count], value[:count]


@equation
def _extrapolated(t, y, at):
    """Return a limit at `at`, outside of all samples, by the order that they support."""
    # Of Newton's form, from the nearest sample on, the sum up to its least term. Beyond all samples
    # it counts less that term, times its ratio to the one before: what the next would be.
    n = min(_NEAREST, t.size)
    if at < t[0]:
        s, values = t[:n] - at, y[:n]
    else:
        s, values = t[::-1][:n] - at, y[::-1][:n]
    c = _differences(s, values, n)[0]
    total, best, least, product = c[0], c[0], np.inf, 1.0
    before, off = np.inf, np.inf
    for m in range(1, n):
        product *= -s[m - 1]
        term = c[m] * product
        total += term
        if abs(term) < least:
            best, least = total, abs(term)
            off = least * min(1.0, least / before) if 0.0 < before < np.inf else least
        before = abs(term)
    high, low = largest_of(y), smallest_of(y)
    if best > high:
        return max(high, best - off)
    return min(low, best + off) if best < low else best


@equation
def limits_at_breaks(t, y, breaks):
    """Return the limits at breaks from both sides: when, and the values."""
    # Arguments as in `turning_points`.
    firsts, lasts, starts, ends = _pieces(t, breaks)
    place, value = np.empty(2 * starts.size), np.empty(2 * starts.size)
    (bottom, top), count = _limits(y), 0
    for first, last, start, end in zip(firsts, lasts, starts, ends):  # noqa: B905 (numba)
        if last == first:
            continue
        if start < t[first]:
            place[count], value[count] = start, _extrapolated(t[first:last], y[first:last], start)
            count += 1
        if end > t[last - 1]:
            place[count], value[count] = end, _extrapolated(t[first:last], y[first:last], end)
            count += 1
    return place[:count], np.minimum(np.maximum(value[:count], bottom), top)


@equation
def _parts(t, y, tolerance):
    """Return into how many parts lines from each sample of a piece to the next are divided."""
    parts = np.ones(t.size, np.int64)
    if t.size < 5 or not tolerance > 0.0:
        return parts
    slopes = consecutive_differences(y) / consecutive_differences(t)
    bends = np.abs(consecutive_differences(slopes) / (t[2:] - t[:-2]))
    for k in range(t.size - 1):
        bend = max(bends[max(k - 1, 0)], bends[min(k, bends.size - 1)])
        gap = bend * (t[k + 1] - t[k]) ** 2 / 4
        parts[k] = 1 + int(min(np.sqrt(gap / tolerance), _PARTS - 1))
    return parts


@equation
def _divide(t, y, k, table, doubt, times, values):
    """Write the times and values that divide the way from sample `k` to the next."""
    a, n = _window(table, k), times.size
    step, rise = t[k + 1] - t[k], y[k + 1] - y[k]
    c = table[a]
    for i in range(n):
        times[i] = t[k] + (i + 1) / (n + 1) * step
    for i in range(n):
        values[i] = c[-1]
    for m in range(c.size - 2, -1, -1):
        for i in range(n):
            values[i] = values[i] * (times[i] - t[a + m]) + c[m]
    farthest = 0.0
    for i in range(n):
        values[i] -= y[k] + (i + 1) / (n + 1) * rise
        farthest = max(farthest, abs(values[i]))
    guard = _GUARD * doubt if farthest > _CLEAR * doubt else np.inf
    for i in range(n):
        off = np.sign(values[i]) * max(abs(values[i]) - guard, 0.0)
        values[i] = y[k] + (i + 1) / (n + 1) * rise + off


@equation
def _follow(t, y, parts, times, values):
    """Write the curve of a piece as points that lines connect; return how many."""
    table, n = _differences(t, y, _coefficients(t.size)), 0
    doubt = _doubt(t, y, table, 0) if t.size > 4 else 0.0
    for k in range(t.size):
        times[n], values[n], n = t[k], y[k], n + 1
        if t.size > 4 and k + 1 < t.size:
            doubt, before = _doubt(t, y, table, k + 1), doubt
            if parts[k] > 1:
                end = n + parts[k] - 1
                _divide(t, y, k, table, max(before, doubt), times[n:end], values[n:end])
                n = end
    return n


@equation
def _put(times, values, n, t, y):
    """Write samples; return how many points there are then."""
    for i in range(t.size):
        times[n + i], values[n + i] = t[i], y[i]
    return n + t.size


@equation
def _beyond(t, y, at):
    """Return limits outside of all samples of a piece."""
    return np.array([_extrapolated(t, y, here) for here in at])


@equation
def path(t, y, breaks, apart=0.0):
    """Return a signal as points that lines connect: curves between breaks, and jumps at them."""
    # Where samples show that a piece is smooth, lines are within 2.5e-7 of the signal's range of
    # its curve, where 32 parts of an interval are enough for that.
    apart = apart if apart > 0.0 else _APART * (t[-1] - t[0])
    tolerance = _LINE * (largest_of(y) - smallest_of(y))
    firsts, lasts, starts, ends = _pieces(t, breaks)
    parts, n = np.ones(t.size, np.int64), 0
    for first, last in zip(firsts, lasts):  # noqa: B905 (numba)
        divided = _parts(t[first:last], y[first:last], tolerance)
        for i in range(divided.size):
            parts[first + i] = divided[i]
    size = np.sum(parts) + 2 * _ENDS * firsts.size
    times, values, done = np.empty(size), np.empty(size), 0
    for first, last, start, end in zip(firsts, lasts, starts, ends):  # noqa: B905 (numba)
        n = _put(times, values, n, t[done:first], y[done:first])  # samples at breaks
        done = max(done, last)
        if last == first:
            continue
        own_t, own_y = t[first:last], y[first:last]
        if start + apart < t[first]:
            at = np.linspace(start + apart, t[first], _ENDS)[:-1]
            n = _put(times, values, n, at, _beyond(own_t, own_y, at))
        n += _follow(own_t, own_y, parts[first:last], times[n:], values[n:])
        if end - apart > t[last - 1]:
            at = np.linspace(t[last - 1], end - apart, _ENDS)[1:]
            n = _put(times, values, n, at, _beyond(own_t, own_y, at))
    n = _put(times, values, n, t[done:], y[done:])
    bottom, top = _limits(y)
    return times[:n], np.minimum(np.maximum(values[:n], bottom), top)
