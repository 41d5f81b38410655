"""Elements and rows that a mask chooses, by their place; tables of pandas; sparse matrices."""

import numpy as np
import pandas as pd
import scipy.sparse as sps

from engineers.entry import engineered

SP = sps.csr_matrix(np.array([[1.0, 0, 2], [0, 0, 3], [4, 5, 0]]))
SA = sps.csr_array(np.array([[1.0, 0, 2], [0, 0, 3], [4, 5, 0]]))
CO = sps.coo_array(([1.0, 2.0, 3.0], ([0, 0, 2], [1, 1, 0])), shape=(3, 3))
DI = sps.diags_array([[1.0, 0.0, 3.0], [1.0, 1.0]], offsets=[0, 1])
DF = pd.DataFrame({"v": [0.0, 1.0, 2.0, 3.0], "k": [1.0, 2.0, 4.0, 3.0]})


@engineered(3)
def arr_mask_last(t, x, u, params):
    v = np.array([0.0, 1.0, 2.0])
    k = np.array([5.0, 6.0, 7.0])
    return [
        k[v <= abs(x[0])][-1],
        k[np.where(v <= abs(x[0]))[0][-1]],
        k[np.nonzero(v <= abs(x[0]))[0].max()],
    ]


@engineered(3)
def rows_of_a_table_up_to_a_time(t, x, u, params):
    T = np.array([[0.0, 1.0, 2.0], [1.0, 2.0, 3.0], [2.0, 5.0, 7.0]])
    r = T[T[:, 0] <= abs(x[0])][-1]
    return [r[1], r[2], T[T[:, 0] <= abs(x[1])][-1, 2]]


@engineered(3)
def positive_ones(t, x, u, params):
    p = x[x > 0]
    return [
        p.max() if p.size else 0.0,
        p[0] if len(p) > 0 else 0.0,
        np.max(p) if p.size > 1 else 0.0,
    ]


@engineered(3)
def first_and_last_places(t, x, u, params):
    i = np.nonzero(x > 0)[0]
    if len(i) == 0:
        return 0 * x
    return [x[i[0]], x[i[-1]], float(i.min())]


@engineered(3)
def first_sign_change(t, x, u, params):
    i = np.flatnonzero(np.diff(np.sign(x)))
    return [float(i[0]) if i.size else -1.0, float(i.size), 0]


@engineered(3)
def a_column_above(t, x, u, params):
    T = np.array([[0.0, 1.0], [1.0, 2.0], [2.0, 5.0]])
    return [
        T[T[:, 0] > x[0], 1].sum(),
        np.min(T[T[:, 0] > min(x[0], 1.5), 1]),
        T[T[:, 0] > min(x[1], 0.5)][:, 1][1],
    ]


@engineered(3)
def first_or_an_error_caught(t, x, u, params):
    try:
        v = x[x > 0][0]
    except IndexError:
        v = -1.0
    return [v, np.where(x > 5)[0][0] if (x > 5).any() else 0, 0]


@engineered(3)
def place_by_argwhere(t, x, u, params):
    k = int(np.argwhere(x >= x.max())[0][0])
    return [float(k), x[k], 0.0]


@engineered(3)
def pandas_mask_last(t, x, u, params):
    r = DF.loc[DF.v <= abs(x[0])].iloc[-1]
    return [r["k"], r.v, 0.0]


@engineered(3)
def pandas_mask_first(t, x, u, params):
    r = DF[DF["v"] > min(abs(x[0]), 2.5)]["k"].iloc[0]
    return [r, 0.0, 0.0]


@engineered(3)
def pandas_query(t, x, u, params):
    k = DF["k"].values[DF["v"].values <= abs(x[0])][-1]
    return [k, 0.0, 0.0]


@engineered(3)
def pandas_searchsorted(t, x, u, params):
    i = DF["v"].searchsorted(x[0])
    i = min(i, 3)
    return [DF["k"].iat[i], 0.0, 0.0]


@engineered(3)
def pandas_methods(t, x, u, params):
    df = (
        pd.DataFrame({"k": [1.0, 2.0, 3.0], "c": [3.0, 2.0, 1.0]})
        .sort_values("c")
        .reset_index(drop=True)
    )
    return df.k.values * x + df["c"].mean() + df.iloc[0]["k"] + df.to_numpy()[0, 0]


@engineered(2, 1)
def pandas_lookup_row(t, x, u, params):
    df = pd.DataFrame({"speed": [0.0, 5.0, 10.0], "kp": [1.0, 2.0, 3.0], "ki": [0.1, 0.2, 0.5]})
    row = df[df["speed"] <= abs(x[0])].iloc[-1]
    return [row["kp"] * (u[0] - x[0]) + row.ki * x[1], u[0] - x[0]]


@engineered(2, 1)
def gain_schedule_interp_df(t, x, u, params):
    tab = pd.DataFrame({"v": [0.0, 5.0, 10.0], "kp": [1.0, 2.0, 3.0]}).set_index("v")
    kp = np.interp(abs(x[0]), tab.index, tab["kp"])
    return [kp * (u[0] - x[0]), x[0]]


@engineered(3)
def products_of_a_sparse_matrix(t, x, u, params):
    return SP * x + x @ SP + SP.T.dot(x)


@engineered(3)
def products_of_a_sparse_array(t, x, u, params):
    return SA @ x + x @ SA + SA.T @ x + (2 * SA + SA @ SA) @ x


@engineered(3)
def by_diagonals_and_coordinates(t, x, u, params):
    return CO @ x + DI @ x + DI.T @ x + CO.sum(axis=1)


@engineered(4)
def sparse_times_dense(t, x, u, params):
    return (SP @ np.outer(x[:3], x))[0] + (x[:3] @ SP)[0]


@engineered(40)
def forty_cells(t, x, u, params):
    A = sps.diags([np.ones(39), -2 * np.ones(40), np.ones(39)], [-1, 0, 1])
    return A @ x - x**3


@engineered(3)
def parts_and_multiples(t, x, u, params):
    return SP.multiply(2.0) @ x + SP.getrow(0).toarray().ravel() * x + SP[1] @ x + SP[0, 2] * SP.nnz


@engineered(3)
def sparse_parts(t, x, u, params):
    return SP.toarray() @ x + SP.diagonal() * x + SP.sum() + np.asarray(SP.sum(axis=1)).ravel()


@engineered(3)
def sparse_inside(t, x, u, params):
    A = sps.diags([1.0, -2.0, 1.0], [-1, 0, 1], shape=(3, 3), format="csc")
    return A.dot(x) + sps.eye(3) @ x + sps.kron(sps.eye(1), A) @ x
