// Online estimation with a fixed-lag smoother: estimates the current state after each measurement, in bounded memory
// and time.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <deque>
#include <random>

#include <tandem/lie/rn.hpp>
#include <tandem/residuals/constant_twist.hpp>
#include <tandem/residuals/prior.hpp>
#include <tandem/solvers/fixed_lag/fixed_lag.hpp>

using namespace tandem;

int main() {
  constexpr double dt = 1.0, sigma = 1.0;  // s, m
  std::mt19937 random(1);
  std::normal_distribution<double> normal;

  FixedLagOptions options;
  options.window = 20.0;  // s; older states are marginalised into a prior
  FixedLag lag(options);
  std::deque<Variable<R3>> last;  // the three newest states
  double fixed = 0.0, estimated = 0.0, slowest = 0.0;
  std::size_t largest = 0, in_window = 0;
  int compared = 0;
  for (int k = 0; k <= 300; ++k) {
    // A point on a wide circle with one fix per second.
    const double t = k * dt, phase = 0.01 * t;
    const Vector<3> truth(100.0 * std::cos(phase), 100.0 * std::sin(phase), -0.05 * t);
    const Vector<3> fix = truth + sigma * Vector<3>(normal(random), normal(random), normal(random));

    last.push_back(lag.add(t, R3(fix), "point " + std::to_string(k)));
    if (last.size() > 3) last.pop_front();
    lag.problem().minimize(Prior<R3>{R3(fix)}, Gaussian{sigma, sigma, sigma}, {last.back()});
    if (last.size() == 3)  // on R3 a constant twist is a constant velocity
      lag.problem().minimize(ConstantTwist<R3>{dt, dt}, Gaussian{0.05, 0.05, 0.05}, {last[0], last[1], last[2]});
    const Summary summary = lag.update();
    if (!summary.converged()) {
      std::printf("at %.0f s: %s\n", t, summary.message.c_str());
      return 1;
    }
    in_window += 1 - lag.marginalized().size();
    largest = std::max(largest, in_window);
    slowest = std::max(slowest, summary.seconds);

    const Vector<3> now = lag.problem().value(last.back()).vector();
    const double deviation = std::sqrt(lag.covariance(last.back())(0, 0));
    if (k % 50 == 0) std::printf("%5.0f s: x = %7.2f ± %.2f m, true %7.2f m\n", t, now.x(), deviation, truth.x());
    if (t < options.window) continue;
    fixed += (fix - truth).norm();
    estimated += (now - truth).norm();
    ++compared;
  }
  std::printf(
      "mean error of the fixes %.2f m, of the estimates %.2f m; %zu points in the window, updates below %.2f ms\n",
      fixed / compared, estimated / compared, largest, 1e3 * slowest);
  return estimated < 0.75 * fixed && largest <= 23 ? 0 : 1;
}
