// The yardstick: Tsitouras 5(4) written for these two loops, K members side by side in SIMD lanes.
//
// Corners of the dead zone, contacts and turning points of the backlash end a step: they are found
// on the cubic through u and u' at the ends of the step.  The backlash is the exact play operator:
// its memory is fixed within a step and committed at its end.
#include "loops.hpp"
#include <cstring>

namespace {

constexpr double C[7] = {0, 0.161, 0.327, 0.9, 0.9800255409045097, 1, 1};
constexpr double A[7][6] = {
    {},
    {0.161},
    {-0.008480655492356989, 0.335480655492357},
    {2.8971530571054935, -6.359448489975075, 4.3622954328695815},
    {5.325864828439257, -11.748883564062828, 7.4955393428898365, -0.09249506636175525},
    {5.86145544294642, -12.92096931784711, 8.159367898576159, -0.071584973281401,
     -0.028269050394068383},
    {0.09646076681806523, 0.01, 0.4798896504144996, 1.379008574103742, -3.290069515436081,
     2.324710524099774}};
constexpr double E[7] = {-0.00178001105222577714, -0.0008164344596567469, 0.007880878010261995,
                         -0.1447110071732629,     0.5823571654525552,     -0.45808210592918697,
                         0.015151515151515152};
constexpr double B[7][4] = {{1, -2.763706197274826, 2.9132554618219126, -1.0530884977290216},
                            {0, 0.1317, -0.2234, 0.1017},
                            {0, 3.9302962368947516, -5.941033872131505, 2.490627285651253},
                            {0, -12.411077166933676, 30.33818863028232, -16.548102889244902},
                            {0, 37.50931341651104, -88.1789048947664, 47.37952196281928},
                            {0, -27.896526289197286, 65.09189467479366, -34.87065786149661},
                            {0, 1.5, -4, 2.5}};
constexpr double NEAR = 1e-8;  // in u: closer to a corner is on it
constexpr int STEPS = 10'000'000;

// u on a step as the cubic through both ends, on [0, 1].
struct Cubic {
    double u0, d0, u1, d1;
    double value(double s) const {
        const double a = 2 * (u0 - u1) + d0 + d1, b = 3 * (u1 - u0) - 2 * d0 - d1;
        return u0 + s * (d0 + s * (b + s * a));
    }
    double slope(double s) const {
        const double a = 2 * (u0 - u1) + d0 + d1, b = 3 * (u1 - u0) - 2 * d0 - d1;
        return d0 + s * (2 * b + s * 3 * a);
    }
};

template <class F> double bisect(F f, double high = 1) {
    double low = 0;
    const bool sign = f(0) > 0;
    for (int i = 0; i < 40; i++) {
        const double middle = 0.5 * (low + high);
        ((f(middle) > 0) == sign ? low : high) = middle;
    }
    return 0.5 * (low + high);
}

// Share of the step at which it has to end: 1 if nothing happens in it.
template <int EXAMPLE> double first_event(const Cubic &u, double memory) {
    const double middle = EXAMPLE == 1 ? 0 : memory / 1.2;
    const double corners[2] = {middle - (EXAMPLE == 1 ? 0.3 : 0.6), middle + 0.5};
    double share = 1;
    for (int side = 0; side < 2; side++) {
        const double outward = side ? 1 : -1, corner = corners[side];
        const double before = (u.u0 - corner) * outward, after = (u.u1 - corner) * outward;
        const bool turns = u.d0 * outward > 0 && u.d1 * outward < 0;
        const double turn = turns ? bisect([&](double s) { return u.slope(s); }) : 1;
        if (EXAMPLE == 2 && before > -NEAR) {  // carried along by this side
            const double peak = u.value(turn);
            if (std::min(std::abs(peak - u.u0), std::abs(peak - u.u1)) > NEAR)
                share = std::min(share, turn);
            continue;
        }
        const double farthest = turns ? (u.value(turn) - corner) * outward : after;
        if (std::abs(before) > NEAR && std::abs(farthest) > NEAR && before * farthest < 0)
            share = std::min(share, bisect([&](double s) { return u.value(s) - corner; }, turn));
    }
    return share;
}

template <int EXAMPLE, int K> class Batch {
    static constexpr int S = Shape<EXAMPLE>::states, n = Shape<EXAMPLE>::n;

  public:
    Batch(const double *centres, const double *x0, const double *times, int count, double rtol)
        : centres(centres), x0(x0), times(times), count(count), rtol(rtol) {}

    // Run members whose x_1(0) is x1[member]; result[(member * rows + i) * count + m].
    int solve(const double *x1, int members, int rows, double *result) {
        int next = 0, left = members;
        for (int k = 0; k < K; k++) load(k, x1, next < members ? next++ : -1, rows, result);
        refresh();
        while (left > 0) {
            attempt();
            bool loaded = false;
            for (int k = 0; k < K; k++) judge(k, rows);
            for (int i = 0; i < S; i++)
                LANES for (int k = 0; k < K; k++) {
                    x[i * K + k] = taken[k] > 0 ? y[i * K + k] : x[i * K + k];
                    d[0][i * K + k] = taken[k] > 0 ? d[6][i * K + k] : d[0][i * K + k];
                }
            for (int k = 0; k < K; k++) {
                if (member[k] < 0 || (m[k] < count && steps[k] < STEPS)) continue;
                if (m[k] < count) return 1;
                left--, loaded = true;
                load(k, x1, next < members ? next++ : -1, rows, result);
            }
            if (loaded && left > 0) refresh();
        }
        return 0;
    }

  private:
    const double *centres, *x0, *times;
    const int count;
    const double rtol;
    alignas(64) double x[S * K], y[S * K], d[7][S * K];
    alignas(64) double t[K], h[K], stage[K], memory[K], u[K], u_rate[K], norm[K], taken[K];
    double previous[K], after_event[K];
    double *target[K];
    int member[K], m[K], steps[K];
    Signals<K> signals;

    void load(int k, const double *x1, int number, int rows, double *result) {
        for (int i = 0; i < S; i++) x[i * K + k] = x0[i];
        member[k] = number, m[k] = 0, steps[k] = 0;
        memory[k] = EXAMPLE == 2 ? x0[S] : 0;
        t[k] = times[0], h[k] = number < 0 ? 0 : 1e-3, previous[k] = 1, after_event[k] = 0;
        if (number < 0) return;
        x[k] = x1[number];
        target[k] = result + static_cast<long>(number) * rows * count;
        for (int i = 0; i < rows; i++) target[k][i * count] = x[i * K + k];
        m[k] = 1;
    }

    // The derivatives at the present states, for lanes that have a new member.
    void refresh() {
        loop<EXAMPLE, K, true>(t, x, memory, centres, d[0], signals);
        std::memcpy(u, signals.u, sizeof u), std::memcpy(u_rate, signals.u_rate, sizeof u_rate);
    }

    template <int s> void weighted() {
        for (int i = 0; i < S; i++)
            LANES for (int k = 0; k < K; k++) {
                double sum = 0;
                for (int j = 0; j < s; j++) sum += A[s][j] * d[j][i * K + k];
                y[i * K + k] = x[i * K + k] + h[k] * sum;
            }
        LANES for (int k = 0; k < K; k++) stage[k] = t[k] + C[s] * h[k];
        loop<EXAMPLE, K, s == 6>(stage, y, memory, centres, d[s], signals);
    }

    void attempt() {
        weighted<1>(), weighted<2>(), weighted<3>(), weighted<4>(), weighted<5>(), weighted<6>();
        const double atol = rtol * 1e-2;
        LANES for (int k = 0; k < K; k++) norm[k] = 0;
        for (int i = 0; i < S; i++)
            LANES for (int k = 0; k < K; k++) {
                double error = 0;
                for (int j = 0; j < 7; j++) error += E[j] * d[j][i * K + k];
                const double size = std::max(std::abs(x[i * K + k]), std::abs(y[i * K + k]));
                const double scaled = h[k] * error / (atol + rtol * size);
                norm[k] += scaled * scaled;
            }
        LANES for (int k = 0; k < K; k++) norm[k] = std::sqrt(norm[k] / S);
    }

    void judge(int k, int rows) {
        taken[k] = 0;
        if (member[k] < 0) return;
        steps[k]++;
        const double size = std::max(norm[k], 1e-10);
        if (!(norm[k] <= 1)) {
            h[k] *= norm[k] < 1e30 ? std::max(0.2, 0.9 * std::pow(size, -0.2)) : 0.1;
            after_event[k] = 0;
            return;
        }
        const Cubic cubic{u[k], h[k] * u_rate[k], signals.u[k], h[k] * signals.u_rate[k]};
        const double share = first_event<EXAMPLE>(cubic, memory[k]);
        if (share < 1) {
            after_event[k] = std::max(after_event[k], h[k]);
            h[k] *= share;
            return;
        }
        sample(k, rows);
        taken[k] = 1;
        t[k] += h[k], u[k] = signals.u[k], u_rate[k] = signals.u_rate[k];
        if (EXAMPLE == 2) memory[k] = play(u[k], memory[k]);
        const double factor = 0.9 * std::pow(size, -0.14) * std::pow(previous[k], 0.08);
        previous[k] = std::max(norm[k], 1e-4);
        h[k] = std::max(h[k] * std::min(5.0, std::max(0.2, factor)), after_event[k]);
        after_event[k] = 0;
    }

    // Fill what lies within the step of lane k that is about to be taken.
    void sample(int k, int rows) {
        for (; m[k] < count && times[m[k]] <= t[k] + h[k]; m[k]++) {
            const double s = (times[m[k]] - t[k]) / h[k];
            double weight[7];
            for (int j = 0; j < 7; j++)
                weight[j] = s * h[k] * (B[j][0] + s * (B[j][1] + s * (B[j][2] + s * B[j][3])));
            for (int i = 0; i < rows; i++) {
                double value = x[i * K + k];
                for (int j = 0; j < 7; j++) value += weight[j] * d[j][i * K + k];
                target[k][i * count + m[k]] = value;
            }
        }
    }
};

template <int EXAMPLE, int K>
int solve(const double *centres, const double *x0, const double *x1, int members,
          const double *times, int count, double rtol, int rows, double *result) {
    Batch<EXAMPLE, K> batch(centres, x0, times, count, rtol);
    return batch.solve(x1, members, rows, result);
}

}  // namespace

extern "C" void right_hand_side(int example, double t, const double *x, const double *centres,
                                double *dx) {
    example == 1 ? relaxed<1>(t, x, centres, dx) : relaxed<2>(t, x, centres, dx);
}

extern "C" int run(int example, int, const double *centres, const double *x0, const double *times,
                   int count, double rtol, double *result) {
    if (example == 1)
        return solve<1, 1>(centres, x0, x0, 1, times, count, rtol, Shape<1>::states, result);
    return solve<2, 1>(centres, x0, x0, 1, times, count, rtol, Shape<2>::states, result);
}

extern "C" int ensemble(int example, int lanes, const double *centres, const double *x0,
                        const double *x1, int members, const double *times, int count, double rtol,
                        double *result) {
    if (example == 1 && lanes == 1)
        return solve<1, 1>(centres, x0, x1, members, times, count, rtol, 2, result);
    if (example == 1)
        return solve<1, 8>(centres, x0, x1, members, times, count, rtol, 2, result);
    if (lanes == 1)
        return solve<2, 1>(centres, x0, x1, members, times, count, rtol, 3, result);
    return solve<2, 8>(centres, x0, x1, members, times, count, rtol, 3, result);
}
