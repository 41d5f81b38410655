// Boost.odeint: controlled Runge-Kutta methods on the loops fused by hand.
#include "loops.hpp"
#include <array>
#include <boost/numeric/odeint.hpp>
#include <vector>

namespace ode = boost::numeric::odeint;

template <int EXAMPLE> struct System {
    static constexpr int size = Shape<EXAMPLE>::states + (EXAMPLE == 2);
    using State = std::array<double, size>;
    const double *centres;
    void operator()(const State &x, State &dx, double t) const {
        relaxed<EXAMPLE>(t, x.data(), centres, dx.data());
    }
};

// Fill result[i * count + m] with state i < rows at times[m].
template <int EXAMPLE>
void solve(int method, const double *centres, const double *x0, const double *times, int count,
           double rtol, int rows, double *result) {
    using State = typename System<EXAMPLE>::State;
    const System<EXAMPLE> system{centres};
    State x;
    std::copy(x0, x0 + x.size(), x.begin());
    int m = 0;
    auto sample = [&](const State &state, double) {
        for (int i = 0; i < rows; i++) result[i * count + m] = state[i];
        m++;
    };
    const double atol = rtol * 1e-2, first = 1e-3;
    if (method == 0)
        ode::integrate_times(
            ode::make_dense_output(atol, rtol, ode::runge_kutta_dopri5<State>()), system, x, times,
            times + count, first, sample);
    else
        ode::integrate_times(
            ode::make_controlled(atol, rtol, ode::runge_kutta_fehlberg78<State>()), system, x,
            times, times + count, first, sample);
}

extern "C" void right_hand_side(int example, double t, const double *x, const double *centres,
                                double *dx) {
    example == 1 ? relaxed<1>(t, x, centres, dx) : relaxed<2>(t, x, centres, dx);
}

extern "C" int run(int example, int method, const double *centres, const double *x0,
                   const double *times, int count, double rtol, double *result) {
    if (example == 1)
        solve<1>(method, centres, x0, times, count, rtol, Shape<1>::states, result);
    else
        solve<2>(method, centres, x0, times, count, rtol, Shape<2>::states, result);
    return 0;
}

extern "C" int ensemble(int example, int method, const double *centres, const double *x0,
                        const double *x1, int members, const double *times, int count, double rtol,
                        double *result) {
    const int n = example + 1, size = n + NODES + 2 + (example == 2);
    std::vector<double> start(x0, x0 + size);
    for (int member = 0; member < members; member++) {
        start[0] = x1[member];
        double *x = result + static_cast<long>(member) * n * count;
        if (example == 1)
            solve<1>(method, centres, start.data(), times, count, rtol, n, x);
        else
            solve<2>(method, centres, start.data(), times, count, rtol, n, x);
    }
    return 0;
}
