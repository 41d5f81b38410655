// The loops of the paper's two examples, fused by hand, for K members side by side.
//
// Arrays hold K numbers per state: x[i * K + k] is state i of member k.  States are x_1..x_n,
// W_hat, delta_hat, zeta; the memory of the backlash is apart, since the tuned program keeps it
// fixed within a step and Boost.odeint relaxes it.
#pragma once
#include <algorithm>
#include <cmath>

// gcc joins sin(a) and cos(a) into one scalar call: good for one lane, hidden from the vectoriser
template <int K> double cosine_of(double angle) {
    return K == 1 ? std::cos(angle) : std::sin(angle + 0.5 * M_PI);
}

#define LANES _Pragma("omp simd")

constexpr int NODES = NODE_COUNT;

template <int EXAMPLE> struct Shape {
    static constexpr int n = EXAMPLE + 1;
    static constexpr int delta = n + NODES;
    static constexpr int zeta = delta + 1;
    static constexpr int states = zeta + 1;
};

struct Gains {
    double beta, sigma_1, gamma, sigma_2, tau;
};

template <int EXAMPLE> constexpr Gains gains() {
    return EXAMPLE == 1 ? Gains{2.5, 0.5, 1.5, 0.5, 0.2} : Gains{5.0, 0.3, 1.2, 0.3, 0.5};
}

// What the integrator wants to know of a right-hand side besides the derivatives.
template <int K> struct Signals {
    double u[K], u_rate[K], v[K];
};

template <int K> double dead_zone(double u) {
    const double right = (1.0 + 0.3 * std::sin(u)) * (u - 0.5);
    const double left = (0.8 + 0.2 * cosine_of<K>(u)) * (u + 0.3);
    return u >= 0.5 ? right : u <= -0.3 ? left : 0.0;
}

inline double play(double u, double memory) {
    return std::min(std::max(memory, 1.2 * (u - 0.5)), 1.2 * (u + 0.6));
}

template <int K> using Lanes = double[K];

// Basis functions: psi[i * K + k] for centres[j * NODES + i].  Padded, so that one lane has no
// remainder of scalar exponentials.
template <int n, int K>
inline void basis(const double *x, const double *centres, double *__restrict psi) {
    constexpr int padded = (NODES * K + 7) / 8 * 8;
    for (int i = NODES * K; i < padded; i++) psi[i] = 0;
    for (int i = 0; i < NODES; i++)
        LANES for (int k = 0; k < K; k++) {
            double squared = 0;
            for (int j = 0; j < n; j++) {
                const double d = x[j * K + k] - centres[j * NODES + i];
                squared += d * d;
            }
            psi[i * K + k] = -0.25 * squared;
        }
    for (int i = 0; i < padded; i++) psi[i] = std::exp(psi[i]);
}

// What the parts of the loop hand to each other; c and s are cos t and sin t, c2 and s2 of t / 2.
template <int K> struct Parts {
    Lanes<K> s, c, s2, c2, r, Y_d, network, robust, eta, N, N_rate;
    alignas(64) double psi[(NODES * K + 7) / 8 * 8];
};

// (14) and (18): the filtered error r and the known part Y_d of its derivative.
template <int EXAMPLE, int K> inline void errors(const double *t, const double *x, Parts<K> &p) {
    LANES for (int k = 0; k < K; k++) {
        const double s2 = std::sin(0.5 * t[k]), c2 = cosine_of<K>(0.5 * t[k]);
        const double s = 2 * s2 * c2, c = 1 - 2 * s2 * s2;
        const double e1 = x[k] - 0.5 * (s + s2), e2 = x[K + k] - (0.5 * c + 0.25 * c2);
        if constexpr (EXAMPLE == 1) {
            p.r[k] = 1.5 * e1 + e2;
            p.Y_d[k] = 0.5 * s + 0.125 * s2 + 1.5 * e2;
        } else {
            const double e3 = x[2 * K + k] + 0.5 * s + 0.125 * s2;
            p.r[k] = e1 + 2 * e2 + e3;
            p.Y_d[k] = 0.5 * c + 0.0625 * c2 + e2 + 2 * e3;
        }
        p.s[k] = s, p.c[k] = c, p.s2[k] = s2, p.c2[k] = c2;
        p.robust[k] = 1 - 2 / (std::exp(2 / gains<EXAMPLE>().tau * p.r[k]) + 1);  // tanh(r / tau)
    }
}

// (23)-(25): the network, the adaptation, and u.
template <int EXAMPLE, int K, bool RATES>
inline void law(const double *__restrict x, double *__restrict dx, Parts<K> &p, double *u) {
    using S = Shape<EXAMPLE>;
    constexpr Gains g = gains<EXAMPLE>();
    LANES for (int k = 0; k < K; k++) p.network[k] = 0;
    for (int i = 0; i < NODES; i++)
        LANES for (int k = 0; k < K; k++) {
            const double W = x[(S::n + i) * K + k], psi = p.psi[i * K + k];
            p.network[k] += W * psi;
            dx[(S::n + i) * K + k] = 0.5 * (p.r[k] * psi - g.sigma_1 * W);
        }
    LANES for (int k = 0; k < K; k++) {
        const double delta_hat = x[S::delta * K + k], zeta = x[S::zeta * K + k], r = p.r[k];
        const double growth = std::exp(zeta * zeta), angle = 0.5 * M_PI * zeta;
        p.eta[k] = g.beta * r + p.network[k] + delta_hat * p.robust[k] + p.Y_d[k];
        p.N[k] = growth * cosine_of<K>(angle);
        if constexpr (RATES)
            p.N_rate[k] = 2 * zeta * p.N[k] - growth * 0.5 * M_PI * std::sin(angle);
        u[k] = p.N[k] * p.eta[k];
        dx[S::delta * K + k] = g.gamma * (r * p.robust[k] - g.sigma_2 * delta_hat);
        dx[S::zeta * K + k] = r * p.eta[k];
    }
}

// The actuator and the plant.
template <int EXAMPLE, int K>
inline void plant(const double *t, const double *__restrict x, const double *memory,
                  const Parts<K> &p, double *__restrict dx, Signals<K> &out) {
    LANES for (int k = 0; k < K; k++) {
        const double x1 = x[k], x2 = x[K + k], cosine = std::cos(x1);
        dx[k] = x2;
        if constexpr (EXAMPLE == 1) {
            const double v = dead_zone<K>(out.u[k]);
            // cos(5 x1) as the Chebyshev polynomial of cos(x1)
            const double q = cosine * cosine, cos_5 = cosine * (5 + q * (16 * q - 20));
            const double forcing = (5 + 0.1 * p.c[k]) * std::cos((0.5 + 0.1 * p.s[k]) * t[k]);
            const double h = (1 + 0.1 * cosine) * (1 + 0.2 * std::cos(v)) * v;
            const double d = 0.1 * (x1 * x1 + x2 * x2) * p.s[k];
            dx[K + k] = 0.2 * x1 - (0.2 + 0.2 * cos_5) * x2 - x1 * x1 * x1 + forcing + h + d;
            out.v[k] = v;
        } else {
            const double x3 = x[2 * K + k], v = play(out.u[k], memory[k]), sine = std::sin(v);
            const double h = (2 + cosine) * (1 + 0.2 * sine * sine) * v;
            dx[K + k] = x3;
            dx[2 * K + k] = -6 * x1 - 3 * x2 - 1.6 * x3 + x1 * x1 + h + std::sin(0.1 * t[k]);
            out.v[k] = v;
        }
    }
}

// u' by the chain rule; r' = x_n' + Y_d.
template <int EXAMPLE, int K>
inline void command_rate(const double *__restrict x, const double *centres,
                         const double *__restrict dx, const Parts<K> &p, Signals<K> &out) {
    using S = Shape<EXAMPLE>;
    constexpr Gains g = gains<EXAMPLE>();
    Lanes<K> network = {};
    for (int i = 0; i < NODES; i++)
        LANES for (int k = 0; k < K; k++) {
            double slope = 0;
            for (int j = 0; j < S::n; j++)
                slope += (x[j * K + k] - centres[j * NODES + i]) * dx[j * K + k];
            const double W = x[(S::n + i) * K + k], W_rate = dx[(S::n + i) * K + k];
            network[k] += p.psi[i * K + k] * (W_rate - 0.5 * slope * W);
        }
    LANES for (int k = 0; k < K; k++) {
        const double last = dx[(S::n - 1) * K + k], r_rate = last + p.Y_d[k], robust = p.robust[k];
        const double fall = 0.5 * p.s[k] + 0.125 * p.s2[k];   // minus the 2nd derivative of yd
        const double bend = 0.5 * p.c[k] + 0.0625 * p.c2[k];  // minus the 3rd
        const double Y_rate = EXAMPLE == 1 ? bend + 1.5 * (last + fall)
                                           : x[(S::n - 1) * K + k] + fall + 2 * (last + bend) -
                                                 0.5 * p.s[k] - 0.03125 * p.s2[k];
        const double eta_rate = g.beta * r_rate + network[k] + dx[S::delta * K + k] * robust +
                                x[S::delta * K + k] * (1 - robust * robust) * r_rate / g.tau +
                                Y_rate;
        out.u_rate[k] = p.N_rate[k] * dx[S::zeta * K + k] * p.eta[k] + p.N[k] * eta_rate;
    }
}

// The derivatives of x at times t, the actuator's memory given.  RATES: u' too.
template <int EXAMPLE, int K, bool RATES>
inline void loop(const double *t, const double *__restrict x, const double *memory,
                 const double *centres, double *__restrict dx, Signals<K> &out) {
    Parts<K> p;
    basis<Shape<EXAMPLE>::n, K>(x, centres, p.psi);
    errors<EXAMPLE, K>(t, x, p);
    law<EXAMPLE, K, RATES>(x, dx, p, out.u);
    plant<EXAMPLE, K>(t, x, memory, p, dx, out);
    if constexpr (RATES) command_rate<EXAMPLE, K>(x, centres, dx, p, out);
}

// One member, the memory relaxed at 1000 1/s as the last state of Example 2.
template <int EXAMPLE>
inline void relaxed(double t, const double *x, const double *centres, double *dx) {
    constexpr int states = Shape<EXAMPLE>::states;
    Signals<1> out;
    loop<EXAMPLE, 1, false>(&t, x, x + states, centres, dx, out);
    if constexpr (EXAMPLE == 2) dx[states] = 1e3 * (out.v[0] - x[states]);
}
