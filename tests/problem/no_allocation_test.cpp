#include <memory>

#include <gtest/gtest.h>

#include <tandem/problem/tracking/target_forecast.hpp>

#include "allocations.hpp"
#include "mixed_problem.hpp"

namespace tandem::testing {
namespace {

template <class F>
long allocations_of(F f) {
  const long before = allocations;
  f();
  return allocations - before;
}

/// A residual that asks the heap for something at every evaluation.
struct Wasteful {
  static constexpr std::string_view name = "wasteful";
  static constexpr int dim = 3;
  using States = std::tuple<R3>;
  void operator()(const R3& x, Vector<3>& r, Matrix<3, 3>* J = nullptr) const {
    const Eigen::MatrixXd I = Eigen::MatrixXd::Identity(3, 3);
    r = I * x.vector();
    if (J) *J = I;
  }
};

TEST(NoAllocation, AWastefulResidualIsCounted) {
  Problem problem;
  const auto x = problem.add(R3({1.0, 2.0, 3.0}));
  for (int i = 0; i < 10; ++i) problem.minimize(Wasteful{}, Gaussian{1.0, 1.0, 1.0}, {x});
  Program program(problem);
  EXPECT_GE(allocations_of([&] { program.cost(); }), 10);
}

TEST(NoAllocation, EvaluationAsksTheHeapForNothing) {
  MixedProblem mixed;
  Program program(mixed.problem);
  const int n = program.num_unknowns();
  const Eigen::VectorXd delta = random_vector(n, 0.5, 1), multipliers = random_vector(program.num_rows(), 1.0, 2);
  Eigen::VectorXd gradient(n), H = hessian_values(program), c(program.num_rows());
  Eigen::VectorXd J(static_cast<Eigen::Index>(program.jacobian_pattern().row.size()));
  const Eigen::VectorXd weights = Eigen::VectorXd::Ones(program.num_rows());
  double sum = 0;
  const auto evaluate = [&] {
    program.move_to(delta);
    sum += program.cost() + program.gradient(gradient) + program.linearize(gradient, H) + program.largest_angle();
    program.constraints(c);
    sum += program.violation(c).size;
    program.constraint_jacobian(J);
    program.linearize_constraints(c, J);
    program.add_constraint_hessian(weights, J, H);
    sum += program.stiffness(delta, weights).along;
    program.exact_hessian(1.0, multipliers, H);
    program.reset();
    sum += program.linearize(gradient, H);
    program.move_to(delta);
    program.recenter();
    sum += program.linearize(gradient, H);
  };
  evaluate();
  EXPECT_EQ(allocations_of(evaluate), 0);
  EXPECT_TRUE(std::isfinite(sum));
}

template <template <LieGroup> class Start, LieGroup G>
void look_ahead(Start<G> start, const TrackingOptions& options) {
  TrackingNoise noise(G::point_dim == 2);
  noise.constant_twist.setConstant(0.05);
  noise.constant_velocity.setConstant(0.05);
  start.covariance.setIdentity();
  std::optional<detail::TargetForecast<G>> there;
  EXPECT_EQ(allocations_of([&] { there = forecast(start, options, noise, 1.0, 4.5); }), 0);
  EXPECT_TRUE(there.has_value());
}

TEST(NoAllocation, AForecastAsksTheHeapForNothing) {
  const auto of_both = []<LieGroup G>(const G& before) {
    using Point = Rn<G::point_dim>;
    typename G::Tangent way = G::Tangent::Zero();
    way[0] = 0.8;
    const G now = before * G::Exp(way);
    const Bounds<1> slow = between(0.0, 0.5);
    for (const Role role : {Role::off, Role::soft}) {
      TrackingOptions options{.non_holonomic = role, .surge = slow, .max_yaw_rate = 0.1, .limits = role};
      look_ahead(detail::PoseForecastStart<G>{before, now, 1.0, {}}, options);
      look_ahead(detail::TwistForecastStart<G>{now, Rn<G::dof>(way), {}}, options);
      look_ahead(detail::PointForecastStart<G>{Point(before.translation()), Point(now.translation()), 1.0, {}},
                 options);
      options.model = MotionModel::damped_twist;
      look_ahead(detail::PoseForecastStart<G>{before, now, 1.0, {}}, options);
    }
  };
  of_both(SE3());
  of_both(SE2());
}

}  // namespace
}  // namespace tandem::testing
