// Model predictive control on SO(3): recovers a tumbling quadrotor to hover. Every 40 ms it plans 30 forward Euler
// stages, warm-started with the shifted previous plan, and applies the first thrusts. The problem is a published
// example of fatrop.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <numbers>
#include <string>
#include <vector>

#include <tandem/residuals/prior.hpp>
#include <tandem/residuals/vehicle/quadrotor.hpp>
#include <tandem/solvers/replanning/damped_sqp.hpp>

using namespace tandem;

namespace {

constexpr int kStages = 30;
constexpr double kStep = 0.04;  // s
const Quadrotor kModel{1.0, {5e-3, 5e-3, 10e-3}, 0.2, 0.05};
const Bounds<4> kThrusts{Vector<4>::Zero(), Vector<4>::Constant(7.3575)};  // N

struct State {
  SO3 attitude;
  Vector<3> rate, position, velocity;
};

State next_state(const State& s, const Vector<4>& thrust) {
  const Vector<3> torque = kModel.torque() * thrust - s.rate.cross(Vector<3>(kModel.inertia.cwiseProduct(s.rate)));
  const Vector<3> push = s.attitude.matrix().col(2) * (thrust.sum() / kModel.mass);
  return {s.attitude * SO3::Exp(kStep * s.rate), s.rate + kStep * torque.cwiseQuotient(kModel.inertia),
          s.position + kStep * s.velocity, s.velocity + kStep * (push - Vector<3>(0.0, 0.0, kModel.gravity))};
}

/// Returns the noise for a weight w in the cost ½ w x², with standard deviation 1/√w.
Gaussian weighted(int rows, double w) {
  return Gaussian(Eigen::VectorXd(Eigen::VectorXd::Constant(rows, 1.0 / std::sqrt(w))));
}

struct RecoveryPlan {
  Problem problem;
  std::vector<Variable<SO3>> attitude;
  std::vector<Variable<R3>> rate, position, velocity;
  std::vector<Variable<Rn<4>>> thrust;

  RecoveryPlan() {
    const Rn<4> hover(Vector<4>(Vector<4>::Constant(kModel.hover())));
    for (int k = 0; k <= kStages; ++k) {
      const std::string at = " at stage " + std::to_string(k);
      rate.push_back(problem.add(R3(), "rate" + at));
      attitude.push_back(problem.add(SO3(), "attitude" + at));
      position.push_back(problem.add(R3(), "position" + at));
      velocity.push_back(problem.add(R3(), "velocity" + at));
      if (k == kStages) break;
      thrust.push_back(problem.add(hover, "thrust" + at));
      problem.minimize(Prior<Rn<4>>{hover}, weighted(4, 0.1), {thrust.back()});
      problem.minimize(Prior<R3>{}, weighted(3, 0.1), {rate.back()});
      problem.subject_to(Prior<Rn<4>>{}, kThrusts, {thrust.back()});
    }
    problem.minimize(Prior<R3>{}, weighted(3, 100.0), {position.back()});
    problem.minimize(Prior<R3>{}, weighted(3, 20.0), {velocity.back()});
    problem.minimize(Prior<SO3>{}, weighted(3, 200.0), {attitude.back()});
    problem.minimize(Prior<R3>{}, weighted(3, 25.0), {rate.back()});
    for (std::size_t k = 0; k < kStages; ++k) {
      problem.subject_to(EulerKinematics<SO3>{kStep}, equal_to(0), {attitude[k], rate[k], attitude[k + 1]});
      problem.subject_to(QuadrotorRate{kModel, kStep}, equal_to(0), {rate[k], thrust[k], rate[k + 1]});
      problem.subject_to(EulerKinematics<R3>{kStep}, equal_to(0), {position[k], velocity[k], position[k + 1]});
      problem.subject_to(QuadrotorVelocity{kModel, kStep}, equal_to(0),
                         {velocity[k], attitude[k], thrust[k], velocity[k + 1]});
    }
    problem.fix(attitude[0]);
    for (const auto& x : {rate[0], position[0], velocity[0]}) problem.fix(x);
  }

  /// Sets the initial guess to the motion from `state` under these thrusts.
  void set(State state, const std::vector<Vector<4>>& thrusts) {
    for (std::size_t k = 0;; ++k) {
      problem.set_value(attitude[k], state.attitude);
      problem.set_value(rate[k], R3(state.rate));
      problem.set_value(position[k], R3(state.position));
      problem.set_value(velocity[k], R3(state.velocity));
      if (k == kStages) return;
      problem.set_value(thrust[k], Rn<4>(thrusts[k]));
      state = next_state(state, thrusts[k]);
    }
  }
  std::vector<Vector<4>> thrusts() const {
    std::vector<Vector<4>> f;
    for (const auto& x : thrust)
      f.push_back(problem.value(x).vector().cwiseMax(kThrusts.lower).cwiseMin(kThrusts.upper));
    return f;
  }
};

}  // namespace

// 07_catch_a_quadrotor [REPLANS [TOLERANCE]]: a solve ends when the predicted decrease of the cost is below TOLERANCE
// times (1 + cost).
int main(int argc, char** argv) {
  const int replans = argc > 1 ? std::max(2, std::atoi(argv[1])) : 150;
  DampedSqp::Options options;
  options.patience = options.max_iterations = 100;
  if (argc > 2) options.cost_tolerance = std::atof(argv[2]);
  State state{SO3::Exp(150.0 / 180.0 * std::numbers::pi * Vector<3>(1.0, 0.4, 0.2).normalized()),
              {5.0, -4.0, 3.0},
              {0.6, -0.4, 0.5},
              {1.2, -1.5, 0.8}};
  RecoveryPlan plan;
  DampedSqp sqp(plan.problem);
  std::vector<Vector<4>> thrusts(kStages, Vector<4>::Constant(kModel.hover()));
  double first = 0.0, worst = 0.0, total = 0.0, violation = 0.0, cost = 0.0;
  int iterations = 0;
  for (int k = 0; k < replans; ++k) {
    const std::clock_t start = std::clock();  // processor time
    plan.set(state, thrusts);
    const Summary summary = sqp.solve(options);
    thrusts = plan.thrusts();
    const double ms = 1e3 * double(std::clock() - start) / CLOCKS_PER_SEC;
    if (!summary.converged()) {
      std::printf("plan %d: %s\n", k, summary.message.c_str());
      return 1;
    }
    if (k == 0) cost = summary.cost;
    (k == 0 ? first : worst) = std::max(k == 0 ? first : worst, ms);
    total += ms;
    iterations += summary.iterations;
    violation = std::max(violation, summary.max_violation);
    state = next_state(state, thrusts.front());
    std::rotate(thrusts.begin(), thrusts.begin() + 1, thrusts.end());
    thrusts.back() = thrusts[kStages - 2];
  }
  std::printf("%d plans: first %.2f ms (cost %.3f), mean %.2f ms, slowest after the first %.2f ms\n", replans, first,
              cost, total / replans, worst);
  std::printf("%.1f iterations per plan, %.3f ms per iteration; largest constraint violation %.1e\n",
              iterations / double(replans), total / iterations, violation);
  const double tilt = state.attitude.Log().norm() * 180.0 / std::numbers::pi;
  std::printf("final distance from hover: %.4f m, %.4f m/s, %.3f degrees, %.4f rad/s\n", state.position.norm(),
              state.velocity.norm(), tilt, state.rate.norm());
  return violation < 1e-6 && (replans < 150 || (state.position.norm() < 0.05 && tilt < 2.0)) ? 0 : 1;
}
