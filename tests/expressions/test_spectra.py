"""Eigenvalues, pseudoinverses and surfaces of expressions are those of NumPy and SciPy."""

import numpy as np
import pytest
from scipy.interpolate import RectBivariateSpline

from nlctl.expressions.arrays import leaf_vector
from nlctl.expressions.evaluate import evaluate_expressions
from nlctl.expressions.graph import Graph, Untraceable
from nlctl.expressions.library.rotated import singular_by_rotations, symmetric_by_rotations
from nlctl.expressions.library.spectra import eigh, eigvals, pinv
from nlctl.expressions.library.splines import called_object

RNG = np.random.default_rng(3)


def values(function, shape, inputs):
    """Return what a function of expressions makes of each of some arrays."""
    graph = Graph()
    found = function(graph, leaf_vector(graph, "x", 0, (int(np.prod(shape)),)).reshape(shape))
    parts = (found.real, found.imag)
    exprs = [e for part in parts for e in part.elements().reshape(-1)]
    rows = [np.array(evaluate_expressions(exprs, {"x": x.reshape(-1)}), float) for x in inputs]
    half = len(exprs) // 2
    return [(row[:half] + 1j * row[half:]).reshape(found.shape) for row in rows]


def test_eigenvalues_of_two_rows_in_lapacks_order():
    """Complex, real, of triangles and of multiples of the unit matrix."""
    matrices = [*RNG.normal(size=(200, 2, 2)), *RNG.integers(-2, 3, (200, 2, 2)).astype(float)]
    apart = [abs(np.subtract(*np.linalg.eigvals(a))) for a in matrices]
    kept = [a for a, d in zip(matrices, apart, strict=True)
            if d > 1e-3 or a[0, 1] * a[1, 0] == 0]  # fmt: skip
    with np.errstate(all="ignore"):
        for a, found in zip(kept, values(eigvals, (2, 2), kept), strict=True):
            np.testing.assert_allclose(found, np.linalg.eigvals(a), rtol=1e-12, atol=1e-13)


@pytest.mark.parametrize("shape", [(1, 3), (2, 3), (3, 2), (2, 2), (2, 6)])
def test_pseudoinverses(shape):
    """Also of columns that are parallel, or 0."""
    matrices = list(RNG.normal(size=(40, *shape)))
    matrices += [np.zeros(shape), np.ones(shape), matrices[0] * [[1.0], [0.0], [0.0]][: shape[0]]]
    matrices.append(np.outer(np.arange(1.0, shape[0] + 1), np.arange(shape[1])))
    with np.errstate(all="ignore"):
        for a, found in zip(matrices, values(pinv, shape, matrices), strict=True):
            size = max(1.0, np.linalg.cond(a)) if np.linalg.matrix_rank(a) == min(shape) else 1.0
            np.testing.assert_allclose(found, np.linalg.pinv(a), rtol=0, atol=1e-13 * size**2)


@pytest.mark.parametrize(("kx", "ky"), [(1, 1), (3, 3), (2, 1)])
def test_a_surface_of_scipy(kx, ky):
    """Inside, on its knots, and beyond its ends."""
    x, y = np.linspace(0, 2, 6), np.array([-1.0, -0.4, 0.0, 1.0, 3.0])
    thing = RectBivariateSpline(x, y, np.sin(np.outer(x, y)), kx=kx, ky=ky)
    points = [np.array(p) for p in zip(RNG.uniform(-1, 3, 60), RNG.uniform(-2, 4, 60), strict=True)]
    points += [np.array([a, b]) for a in x for b in y]
    found = values(lambda g, p: called_object(g, thing, p[0], p[1], grid=False), (2,), points)
    for p, value in zip(points, found, strict=True):
        np.testing.assert_allclose(value, thing.ev(*p), rtol=1e-12, atol=1e-13)


def symmetric(a):
    """The symmetric part of a matrix."""
    return 0.5 * (a + a.T)


@pytest.mark.parametrize("rows", [3, 4, 5])
def test_eigenvalues_of_symmetric_matrices_by_rotations(rows):
    """Of random ones, of equal eigenvalues, of blocks, of sizes that differ by twelve decades."""
    graded = np.diag(10.0 ** np.linspace(-12, 0, rows))
    turned, _ = np.linalg.qr(RNG.normal(size=(rows, rows)))
    twice = turned @ np.diag([2.0, 2.0, *[-1.0] * (rows - 2)]) @ turned.T
    matrices = [symmetric(a) for a in RNG.normal(size=(40, rows, rows))]
    matrices += [np.zeros((rows, rows)), np.ones((rows, rows)), -np.eye(rows), symmetric(twice)]
    matrices += [graded, symmetric(turned @ graded @ turned.T)]
    found = values(symmetric_by_rotations, (rows, rows), matrices)
    for a, one in zip(matrices, found, strict=True):
        size = max(np.abs(a).max(), 1e-300)
        np.testing.assert_allclose(one.real, np.linalg.eigvalsh(a), rtol=0, atol=2e-14 * size)


@pytest.mark.parametrize("shape", [(3, 3), (2, 5), (4, 3)])
def test_singular_values_by_rotations(shape):
    """Their number is that of the shorter side; of equal columns all but one are 0."""
    matrices = [*RNG.normal(size=(40, *shape)), np.ones(shape), np.zeros(shape), np.eye(*shape)]
    found = values(singular_by_rotations, shape, matrices)
    for a, one in zip(matrices, found, strict=True):
        exact = np.linalg.svd(a, compute_uv=False)
        np.testing.assert_allclose(one.real, exact, rtol=0, atol=2e-14 * (1 + exact[0]))


@pytest.mark.parametrize(("dx", "dy"), [(1, 0), (0, 2), (1, 1)])
def test_derivatives_of_a_surface(dx, dy):
    """By SciPy's own; of as many orders as it has degrees SciPy raises an error."""
    x, y = np.linspace(0, 2, 6), np.array([-1.0, -0.4, 0.0, 1.0, 3.0])
    thing = RectBivariateSpline(x, y, np.sin(np.outer(x, y)))
    points = list(RNG.uniform((-1, -2), (3, 4), (60, 2)))
    found = values(lambda g, p: called_object(g, thing, p[0], p[1], dx, dy, False), (2,), points)
    for p, value in zip(points, found, strict=True):
        np.testing.assert_allclose(value, thing.ev(*p, dx=dx, dy=dy), rtol=1e-12, atol=1e-13)
    with pytest.raises(Untraceable, match="orders"):
        values(lambda g, p: called_object(g, thing, p[0], p[1], 3, 0, False), (2,), points)


@pytest.mark.parametrize("half", ["L", "U"])
def test_eigenvectors_of_two_rows_with_lapacks_signs(half):
    """Of all signs and sizes, of diagonals, and of multiples of the unit matrix."""
    matrices = [*RNG.normal(size=(200, 2, 2)) * 10.0 ** RNG.integers(-3, 4, (200, 2, 2))]
    matrices += [*RNG.integers(-2, 3, (200, 2, 2)).astype(float)]
    with np.errstate(all="ignore"):
        every = values(lambda g, a: eigh(g, a, half).eigenvectors, (2, 2), matrices)
    for a, vectors in zip(matrices, every, strict=True):
        wanted = np.linalg.eigh(a, half).eigenvectors
        np.testing.assert_allclose(vectors, wanted, rtol=1e-12, atol=1e-13)
