"""Memory that is no state, in closures, globals and attributes: calls before count."""

import numpy as np

from ._entry import entry, pieces


@entry(pure=False)
def closure_with_nonlocal(n):
    step, y = 0, 0.0

    def output(t, x, u, params):
        nonlocal step, y
        step += 1
        y = 0.9 * y + u[0]
        return y + step

    return pieces(None, output)


@entry(pure=False)
def closure_appends_to_a_list(n):
    history = []

    def update(t, x, u, params):
        history.append(u[0])
        return -x + sum(history)

    return pieces(update, states=n)


@entry(pure=False)
def closure_writes_a_dict(n):
    memory = {"last": 0.0}

    def update(t, x, u, params):
        rate = u[0] - memory["last"]
        memory["last"] = u[0]
        return -x + rate

    return pieces(update, states=n)


@entry(pure=False)
def closure_writes_an_array(n):
    old = np.zeros(n)

    def update(t, x, u, params):
        dx = x - old
        old[:] = x
        return dx

    return pieces(update, states=n)


@entry(pure=False)
def array_grows_in_place(n):
    total = np.zeros(n)

    def update(t, x, u, params):
        acc = total
        acc += x
        return -acc

    return pieces(update, states=n)


@entry(pure=False)
def array_grows_through_a_view(n):
    total = np.zeros((2, n))

    def update(t, x, u, params):
        row = total[1]
        part = row[-1:]
        part += u[0]
        return -x + total.sum()

    return pieces(update, states=n)


@entry(pure=False)
def written_by_a_helper(n):
    buffer = [0.0]

    def keep(store, value):
        store[0] = store[0] + value
        return store[0]

    def update(t, x, u, params):
        return -x + keep(buffer, u[0])

    return pieces(update, states=n)


@entry(pure=False)
def global_number(n):
    global CALLS
    CALLS = 0

    def update(t, x, u, params):
        global CALLS
        CALLS += 1
        return -x * CALLS

    return pieces(update, states=n)


CALLS = 0


@entry(pure=False)
def global_list(n):
    LOG.clear()

    def update(t, x, u, params):
        LOG.append(t)
        return -x + len(LOG)

    return pieces(update, states=n)


LOG = []


@entry(pure=False)
def attribute_of_self(n):
    class Integrator:
        def __init__(self):
            self.total = 0.0

        def update(self, t, x, u, params):
            self.total += u[0]
            return -x + self.total

    return pieces(Integrator().update, states=n)


@entry(pure=False)
def relay_with_hysteresis(n):
    class Relay:
        on = False  # of the class, until the first switch

        def __call__(self, t, x, u, params):
            if u[0] > 0.5:
                self.on = True
            elif u[0] < -0.5:
                self.on = False
            return 1.0 if self.on else -1.0

    return pieces(None, Relay())


@entry(pure=False)
def attribute_set_by_setattr(n):
    class Plant:
        last = 0.0

    plant = Plant()

    def update(t, x, u, params):
        k = plant.last
        setattr(plant, "last", float(u[0]))
        return -x + k

    return pieces(update, states=n)


@entry(pure=False)
def attribute_set_by_a_method_of_self(n):
    class Filter:
        def __init__(self):
            self.state = 0.0

        def _advance(self, v):
            self.state = 0.5 * self.state + v

        def update(self, t, x, u, params):
            self._advance(u[0])
            return -x + self.state

    return pieces(Filter().update, states=n)


@entry(pure=False)
def property_with_a_setter(n):
    class Plant:
        _k = 1.0

        @property
        def k(self):
            return self._k

        @k.setter
        def k(self, value):
            self._k = value

        def update(self, t, x, u, params):
            self.k = self.k * 1.1
            return -self.k * x

    return pieces(Plant().update, states=n)


@entry(pure=False)
def property_that_counts(n):
    class Plant:
        count = 0

        @property
        def k(self):
            self.count += 1
            return self.count

        def update(self, t, x, u, params):
            return -self.k * x

    return pieces(Plant().update, states=n)


@entry(pure=False)
def class_attribute_counts(n):
    class Plant:
        count = 0

        def update(self, t, x, u, params):
            Plant.count += 1
            return -x * Plant.count

    return pieces(Plant().update, states=n)


@entry(pure=False)
def function_attribute(n):
    def update(t, x, u, params):
        update.calls += 1
        return -x * update.calls

    update.calls = 0
    return pieces(update, states=n)
