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
def _pieces(t, breaks):
    """Return the pieces between breaks: first and last + 1 of their samples, start and end (s)."""
    # Samples at a break belong to no piece: they are values of their own, of one side or the other.
    span = t[-1] - t[0]
    near = max(1e-9 * span / t.size, 4 * _APART * span)
    inside = breaks[(breaks >= t[0] - near) & (breaks <= t[-1] + near)]
    n = inside.size
    first, last = np.zeros(n + 1, np.int64), np.full(n + 1, t.size)
    start, end = np.full(n + 1, t[0]), np.full(n + 1, t[-1])
    first[1:] = np.searchsorted(t, inside + near, "right")
    last[:n] = np.searchsorted(t, inside - near, "left")
    start[1:] = inside
    end[:n] = inside
    return first, np.maximum(last, first), start, end


@equation
def _window(first, last, k):
    """Return the samples of a piece of five or more around sample `k` that a curve goes through."""
    count = min(2 * _HALF + 1, max(last - first - 2, 4))
    a = min(max(k - _HALF, first), last - count)
    return a, a + count


@equation
def _defect(t, y, a, b, k):
    """Return how far sample `k` is from where others of [a, b) say, or what rounding makes."""
    defect, size = 0.0, abs(y[k])
    for j in range(a, b):
        size = max(size, abs(y[j]))
        if j == k:
            continue
        weight = 1.0
        for m in range(a, b):
            if m not in (j, k):
                weight *= (t[k] - t[m]) / (t[j] - t[m])
        defect += weight * (y[j] - y[k])
    return max(abs(defect), _ROUNDING * size)


@equation
def _doubt(t, y, first, last, k):
    """Return the largest defect of a sample among the neighbours of three windows."""
    a, b = _window(first, last, k)
    begin = max(min(a - 1, last - (b - a) - 2), first)
    doubt = 0.0
    for start in range(begin, min(begin + 3, last - (b - a) + 1)):
        doubt = max(doubt, _defect(t, y, start, start + b - a, k))
    return doubt


@equation
def _coefficients(s, y):
    """Return the coefficients of Newton's form of the polynomial through all points."""
    c = y.copy()
    for m in range(1, c.size):
        for j in range(c.size - 1, m - 1, -1):
            c[j] = (c[j] - c[j - 1]) / (s[j] - s[j - m])
    return c


@equation
def _at(s, c, x):
    """Return the polynomial of `_coefficients` with its first and second derivative."""
    p, d, dd = c[-1], 0.0, 0.0
    for m in range(c.size - 2, -1, -1):
        dd = dd * (x - s[m]) + 2 * d
        d = d * (x - s[m]) + p
        p = p * (x - s[m]) + c[m]
    return p, d, dd


@equation
def _turn(t, y, first, last, k, low, high):
    """Return place and value of the extreme next to sample `k`, in [low, high], and if it is."""
    # The sample is the largest or the smallest of its neighbours in the piece [first, last).
    a, b = _window(first, last, k)
    s, x = t[a:b] - t[k], 0.0
    c = _coefficients(s, y[a:b] - y[k])
    for _ in range(5):  # Newton's method: quadratic from the sample
        _, d, dd = _at(s, c, x)
        x = min(max(x - d / dd, low - t[k]), high - t[k]) if dd != 0.0 else 0.0
    gain, d, dd = _at(s, c, x)
    doubt = _doubt(t, y, first, last, k)
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
    low, high = np.min(y), np.max(y)
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
        d = consecutive_differences(y[first:last])
        up, down = np.ones(last - first), -np.ones(last - first)
        up[1:], down[:-1] = d, d
        up[0], down[-1] = -d[0], -d[-1]
        turns = ((up > 0) & (down <= 0)) | ((up < 0) & (down >= 0))
        for k in np.nonzero(turns)[0] + first:
            low, high = t[k - 1] if k > first else start, t[k + 1] if k + 1 < last else end
            at, extreme, is_clear = _turn(t, y, first, last, k, low, high)
            is_clear &= bottom <= extreme <= top and (count == 0 or at > place[count - 1])
            if is_clear and at > low and at < high and at != t[k]:
                place[count], value[count], before[count] = at, extreme, k + (at > t[k])
                count += 1
    return before[:count], place[:count], value[:count]


@equation
def _extrapolated(t, y, at):
    """Return a limit at `at`, outside of all samples, by the order that they support."""
    # Of Newton's form, from the nearest sample on, the sum up to its least term. Beyond all samples
    # it counts less that term, times its ratio to the one before: what the next would be.
    n = min(_NEAREST, t.size)
    if at < t[0]:
        s, values = t[:n] - at, y[:n].copy()
    else:
        s, values = t[::-1][:n] - at, y[::-1][:n].copy()
    c = _coefficients(s, values)
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
    high, low = np.max(y), np.min(y)
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
def _parts(t, y, first, last, k, tolerance):
    """Return into how many parts lines from sample `k` to the next are divided."""
    bend = 0.0
    for j in (max(k, first + 1), min(k + 1, last - 2)):
        if first < j < last - 1:
            rise = (y[j + 1] - y[j]) / (t[j + 1] - t[j]) - (y[j] - y[j - 1]) / (t[j] - t[j - 1])
            bend = max(bend, abs(rise / (t[j + 1] - t[j - 1])))
    gap = bend * (t[k + 1] - t[k]) ** 2 / 4
    return int(min(np.ceil(np.sqrt(gap / tolerance)), _PARTS)) if tolerance > 0.0 else 1


@equation
def _between(t, y, first, last, k, parts):
    """Return the times and values that divide the way from sample `k` to the next."""
    share = np.arange(1, parts) / parts
    at = t[k] + share * (t[k + 1] - t[k])
    line = share * (y[k + 1] - y[k])
    a, b = _window(first, last, k)
    s = t[a:b] - t[k]
    c = _coefficients(s, y[a:b] - y[k])
    off = np.array([_at(s, c, x)[0] for x in at - t[k]]) - line
    doubt = max(_doubt(t, y, first, last, k), _doubt(t, y, first, last, k + 1))
    if not np.max(np.abs(off)) > _CLEAR * doubt:
        off = 0.0 * off
        doubt = 0.0
    return at, y[k] + line + np.sign(off) * np.maximum(np.abs(off) - _GUARD * doubt, 0.0)


@equation
def path(t, y, breaks, apart=0.0):
    """Return a signal as points that lines connect: curves between breaks, and jumps at them."""
    # Where samples show that a piece is smooth, lines are within 2.5e-7 of the signal's range of
    # its curve, where 32 parts of an interval are enough for that.
    apart = apart if apart > 0.0 else _APART * (t[-1] - t[0])
    tolerance = _LINE * (np.max(y) - np.min(y))
    firsts, lasts, starts, ends = _pieces(t, breaks)
    times, values = [t[:0].copy()], [y[:0].copy()]
    done = 0
    for first, last, start, end in zip(firsts, lasts, starts, ends):  # noqa: B905 (numba)
        times.append(t[done:first].copy())  # samples at breaks
        values.append(y[done:first].copy())
        done = max(done, last)
        if last == first:
            continue
        own_t, own_y = t[first:last], y[first:last]
        if start + apart < t[first]:
            for at in np.linspace(start + apart, t[first], _ENDS)[:-1]:
                times.append(np.array([at]))
                values.append(np.array([_extrapolated(own_t, own_y, at)]))
        for k in range(first, last):
            times.append(t[k : k + 1].copy())
            values.append(y[k : k + 1].copy())
            parts = _parts(t, y, first, last, k, tolerance) if k + 1 < last else 1
            if parts > 1 and last - first > 4:
                at, here = _between(t, y, first, last, k, parts)
                times.append(at)
                values.append(here)
        if end - apart > t[last - 1]:
            for at in np.linspace(t[last - 1], end - apart, _ENDS)[1:]:
                times.append(np.array([at]))
                values.append(np.array([_extrapolated(own_t, own_y, at)]))
    times.append(t[done:].copy())
    values.append(y[done:].copy())
    bottom, top = _limits(y)
    return _joined(times), np.minimum(np.maximum(_joined(values), bottom), top)


@equation
def _joined(parts):
    """Return arrays one after another; numba's `concatenate` takes no list."""
    size = 0
    for part in parts:
        size += part.size
    whole, done = np.empty(size), 0
    for part in parts:
        whole[done : done + part.size] = part
        done += part.size
    return whole
