#include <gtest/gtest.h>

#include <tandem/problem/planning/discretisation_error.hpp>

namespace tandem::testing {
namespace {

/// A vehicle that moves along x only, with linear drag: the response to a step of the thrust is known.
VehicleModel<3> sled() {
  VehicleModel<3> v;
  v.mass = Matrix<6, 6>::Identity();
  v.linear.diagonal().setConstant(2.0);
  v.thrust(0, 0) = 1.0;
  v.thrust(5, 1) = 1.0;
  v.lower.setConstant(-10.0);
  v.upper.setConstant(10.0);
  return v;
}

/// Returns the roll-out of these commands with steps of `dt`.
Plan<3> roll_out(const VehicleModel<3>& vehicle, double dt, const std::vector<Vector<3>>& commands) {
  const VehicleStep<3> step(vehicle, dt);
  Plan<3> plan{{VehicleState<3>{}}, commands};
  for (const Vector<3>& command : commands)
    plan.states.push_back(step(plan.states.back(), command, Vector<3>(Vector<3>::Zero())));
  return plan;
}

TEST(DiscretisationError, IsThatOfTheExactSolution) {
  const VehicleModel<3> vehicle = sled();
  const double dt = 1.0, thrust = 4.0, rate = 2.0;
  const std::vector<Vector<3>> commands(3, Vector<3>(thrust, 0.0, 0.0));
  const Plan<3> plan = roll_out(vehicle, dt, commands);
  double exact = 0.0;
  for (std::size_t k = 1; k < plan.states.size(); ++k) {
    const double t = double(k) * dt;
    const double x = thrust / rate * (t - (1.0 - std::exp(-rate * t)) / rate);  // x'' = thrust − rate x'
    exact = std::max(exact, std::abs(plan.states[k].pose.translation().x() - x));
  }
  EXPECT_GT(exact, 0.1);
  const DiscretisationError error = discretisation_error(vehicle, plan, dt, Vector<3>(Vector<3>::Zero()));
  EXPECT_NEAR(error.position, exact, 0.01 * exact);
  EXPECT_LE(error.heading, 1e-12);
}

TEST(DiscretisationError, DecreasesWithTheSquareOfTheStep) {
  const VehicleModel<3> vehicle = sled();
  const auto error = [&](int parts) {
    const std::vector<Vector<3>> commands(std::size_t(2 * parts), Vector<3>(4.0, 1.0, 0.0));
    const double dt = 1.0 / parts;
    return discretisation_error(vehicle, roll_out(vehicle, dt, commands), dt, Vector<3>(Vector<3>::Zero()));
  };
  const DiscretisationError coarse = error(2), fine = error(4);
  EXPECT_NEAR(coarse.position / fine.position, 4.0, 0.8);
  EXPECT_NEAR(coarse.heading / fine.heading, 4.0, 0.8);
}

}  // namespace
}  // namespace tandem::testing
