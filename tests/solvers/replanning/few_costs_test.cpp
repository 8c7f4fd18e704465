#include <string>

#include <gtest/gtest.h>

#include <tandem/residuals/prior.hpp>
#include <tandem/residuals/vehicle/quadrotor.hpp>
#include <tandem/solvers/augmented_lagrangian.hpp>
#include <tandem/solvers/replanning/damped_sqp.hpp>

namespace tandem::testing {
namespace {

/// A tilted and moving quadrotor must hover at the origin after a second. Only the final state and the thrusts have a
/// cost; hard equalities determine the other states.
struct Hover {
  static constexpr int steps = 25;
  static constexpr double dt = 0.04;  // s
  const Quadrotor model{1.0, {5e-3, 5e-3, 10e-3}, 0.2, 0.05};
  Problem problem;
  std::vector<Variable<SO3>> attitude;
  std::vector<Variable<R3>> rate, position, velocity;
  std::vector<Variable<Rn<4>>> thrust;

  Hover() {
    const Rn<4> hover(Vector<4>(Vector<4>::Constant(model.hover())));
    for (int k = 0; k <= steps; ++k) {
      const std::string at = " at " + std::to_string(k);
      rate.push_back(problem.add(R3(), "rate" + at));
      attitude.push_back(problem.add(SO3::Exp({0.6, 0.2, 0.1}), "attitude" + at));
      position.push_back(problem.add(R3({0.3, -0.2, 0.1}), "position" + at));
      velocity.push_back(problem.add(R3({0.5, -0.3, 0.2}), "velocity" + at));
      if (k == steps) break;
      thrust.push_back(problem.add(hover, "thrust" + at));
      problem.minimize(Prior<Rn<4>>{hover}, Gaussian{3.0, 3.0, 3.0, 3.0}, {thrust.back()});
      problem.subject_to(Prior<Rn<4>>{}, between(0.0, 7.3575), {thrust.back()});
    }
    for (const auto& x : {position.back(), velocity.back(), rate.back()})
      problem.minimize(Prior<R3>{}, Gaussian{0.1, 0.1, 0.1}, {x});
    problem.minimize(Prior<SO3>{}, Gaussian{0.1, 0.1, 0.1}, {attitude.back()});
    for (std::size_t k = 0; k < steps; ++k) {
      problem.subject_to(EulerKinematics<SO3>{dt}, equal_to(0), {attitude[k], rate[k], attitude[k + 1]});
      problem.subject_to(QuadrotorRate{model, dt}, equal_to(0), {rate[k], thrust[k], rate[k + 1]});
      problem.subject_to(EulerKinematics<R3>{dt}, equal_to(0), {position[k], velocity[k], position[k + 1]});
      problem.subject_to(QuadrotorVelocity{model, dt}, equal_to(0),
                         {velocity[k], attitude[k], thrust[k], velocity[k + 1]});
    }
    problem.fix(attitude[0]);
    for (const auto& x : {rate[0], position[0], velocity[0]}) problem.fix(x);
  }
};

/// Unknowns without a cost need damping, and their constraints need a weight.
TEST(FewCosts, BothSolversFindTheSameSolution) {
  Hover by_sqp, by_lagrangian;
  DampedSqp sqp(by_sqp.problem);
  DampedSqp::Options options;
  options.cost_tolerance = 1e-8;
  options.patience = options.max_iterations = 100;
  const Summary s = sqp.solve(options);
  ASSERT_TRUE(s.converged()) << s.message;
  EXPECT_LE(s.max_violation, options.feasible);
  const Summary reference = solve(by_lagrangian.problem, AugmentedLagrangianOptions{});
  ASSERT_TRUE(reference.converged()) << reference.message;
  EXPECT_NEAR(s.cost, reference.cost, 1e-5 * reference.cost);
  EXPECT_LE(by_sqp.problem.value(by_sqp.position.back()).vector().norm(), 0.1);
}

}  // namespace
}  // namespace tandem::testing
