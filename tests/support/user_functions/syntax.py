"""Python as such: walrus, match, comprehensions, unpacking, strings, generators."""

import numpy as np

from ._entry import entry, pieces


@entry
def walrus(n):
    def update(t, x, u, params):
        if (v := abs(u[0])) > 0.5:
            return -x * v
        return [(w := xi * 2) + w for xi in x]

    return pieces(update, states=n)


@entry
def match_on_a_string(n):
    def update(t, x, u, params):
        match params["mode"]:
            case "slow":
                return -0.1 * x
            case "fast" | "faster":
                return -10 * x + u[0]
            case _:
                return x

    return pieces(update, states=n, mode="fast")


@entry
def match_on_a_size(n):
    def update(t, x, u, params):
        match len(x):
            case 2:
                k = 1.0
            case m if m < 10:
                k = 2.0
            case _:
                k = 3.0
        match u.shape:
            case (2,):
                k += 0.5
        return -k * x

    return pieces(update, states=n)


@entry
def match_on_a_value(n):
    def update(t, x, u, params):
        match (u[0] > 0, u[1] > 0):
            case (True, True):
                k = 1.0
            case (False, _):
                k = 2.0
            case _:
                k = 3.0
        return -k * x

    return pieces(update, states=n)


@entry
def comprehension(n):
    def update(t, x, u, params):
        return [-xi + u[0] * i for i, xi in enumerate(x)]

    return pieces(update, states=n)


@entry
def comprehension_with_condition(n):
    def update(t, x, u, params):
        positive = [v for v in x if v > 0]
        odd = [v for i, v in enumerate(x) if i % 2]
        return -x + sum(positive) + len(positive) + sum(odd)

    return pieces(update, states=n)


@entry
def nested_comprehension(n):
    def update(t, x, u, params):
        m = np.array([[a * b for b in u] for a in x])
        flat = [v for row in m for v in row]
        return m[:, 0] + m[:, 1] + flat[-1]

    return pieces(update, states=n)


@entry
def dict_and_set_comprehension(n):
    def update(t, x, u, params):
        named = {f"x{i}": v for i, v in enumerate(x)}
        kinds = {int(v > 0) for v in u}
        return [-named[f"x{i}"] for i in range(n)] + np.array(len(kinds) + u[0])

    return pieces(update, states=n)


@entry
def generator_expression(n):
    def update(t, x, u, params):
        return -x + sum(v * v for v in x) + max(abs(v) for v in u)

    return pieces(update, states=n)


@entry
def generator_function(n):
    """Its memory does not outlive the call."""

    def neighbours(v):
        for a, b in zip(v, v[1:]):
            yield b - a
        yield -v[-1]

    def update(t, x, u, params):
        return list(neighbours(x)) * np.ones(1) + u[0]

    return pieces(update, states=n)


@entry
def star_unpacking(n):
    def update(t, x, u, params):
        a, b, *rest = x
        return np.array([b, a * u[0], *rest])

    return pieces(update, states=n)


@entry
def unpacked_parameters(n):
    def update(t, x, u, params):
        k, m = (params[key] for key in ("k", "m"))
        v, w = map(float, u)
        return -k / m * x + v * w

    return pieces(update, states=n, k=2.0, m=1.5)


@entry
def star_arguments(n):
    def weighted(*values, scale=1.0, **more):
        return scale * sum(values) + more.get("bias", 0.0) + len(values)

    def update(t, x, u, params):
        return -x + weighted(*u, scale=params["s"]) + weighted(1.0, **{"bias": u[0]})

    return pieces(update, states=n, s=0.2)


@entry
def update_with_star_arguments(n):
    def update(*args):
        t, x, u, params = args
        return -x * params["k"] + u[0] * t

    return pieces(update, states=n, k=1.2)


@entry
def default_params_of_the_function(n):
    def update(t, x, u, params={}):
        return -x * params.get("k", 2.0) + params.get("absent", 0.5) * u[0]

    return pieces(update, states=n, k=1.2)


@entry
def params_none(n):
    def update(t, x, u, params=None):
        if params is None:
            params = {"k": 1.0}
        return -x * params["k"]

    return pieces(update, states=n, k=1.2)


@entry
def keyword_only_default(n):
    def update(t, x, u, params, *, gain=3.0):
        return -gain * x + u[0]

    return pieces(update, states=n)


@entry
def other_argument_names(n):
    def update(time, state, inp, p):
        return -p["k"] * state + np.exp(-time) * inp[0]

    return pieces(update, states=n, k=1.2)


@entry
def string_keys_made_in_a_loop(n):
    def update(t, x, u, params):
        dx = np.zeros(n)
        for i in range(2):
            dx[i] = -params["k" + str(i)] * x[i]
        for name in ("a", "b"):
            dx += params[f"gain_{name}"]
        return dx

    return pieces(update, states=n, k0=1.0, k1=2.0, gain_a=0.1, gain_b=0.2)


@entry
def loop_over_params(n):
    def update(t, x, u, params):
        total = 0.0
        for key in sorted(params):
            if key.startswith("w"):
                total += params[key]
        return -x * total + sum(params.values()) + len(params)

    return pieces(update, states=n, w1=0.5, w2=0.7, z=0.1)


@entry
def local_dict_of_functions(n):
    def update(t, x, u, params):
        shapes = {"sin": np.sin, "square": lambda v: v**2}
        return shapes[params["shape"]](x) + u[0]

    return pieces(update, states=n, shape="square")


@entry
def del_and_global_constants(n):
    def update(t, x, u, params):
        tmp = x * 2
        y = tmp
        del tmp
        return y - GRAVITY * u[0]

    return pieces(update, states=n)


GRAVITY = 9.81


@entry
def nested_function_and_local_class(n):
    def update(t, x, u, params):
        class Local:
            gain = 2.0

        def inner(v):
            return v * Local.gain + u[0]

        return inner(x)

    return pieces(update, states=n)


@entry
def nonlocal_within_a_call(n):
    """A counter that begins anew in every call."""

    def update(t, x, u, params):
        total = 0.0

        def add(v):
            nonlocal total
            total += v * u[0]
            return total

        return [add(v) for v in x]

    return pieces(update, states=n)


@entry
def prints_when_asked(n):
    def update(t, x, u, params):
        if params["verbose"]:
            print("x =", x)
        return -x + u[0]

    return pieces(update, states=n, verbose=False, changed={})


@entry
def dict_of_locals(n):
    def update(t, x, u, params):
        s = dict(zip(["p", "q"], u))
        s["r"] = s["p"] * s.pop("q")
        s |= {"w": 1.0}
        return -x + s["r"] + s.get("q", 4.0) + ("q" in s) + s["w"]

    return pieces(update, states=n)


@entry
def list_methods(n):
    def update(t, x, u, params):
        dx = []
        for v in x:
            dx.append(-v)
        dx.insert(0, u[0])
        dx.pop()
        dx.reverse()
        dx.extend([])
        return dx

    return pieces(update, states=n)


@entry
def tuple_arithmetic(n):
    def update(t, x, u, params):
        return (u[0],) + tuple(x[1:]) if u[1] > 0 else (0.0,) * n

    return pieces(update, states=n)
