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

/// Residual that allocates in every evaluation.
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

TEST(NoAllocation, CountsAllocationsOfAResidual) {
  Problem problem;
  const auto x = problem.add(R3({1.0, 2.0, 3.0}));
  for (int i = 0; i < 10; ++i) problem.minimize(Wasteful{}, Gaussian{1.0, 1.0, 1.0}, {x});
  NlpEvaluator nlp(problem);
  EXPECT_GE(allocations_of([&] { nlp.cost(); }), 10);
}

TEST(NoAllocation, EvaluationDoesNotAllocate) {
  MixedProblem mixed;
  NlpEvaluator nlp(mixed.problem);
  const int n = nlp.num_unknowns();
  const Eigen::VectorXd delta = random_vector(n, 0.5, 1), multipliers = random_vector(nlp.num_rows(), 1.0, 2);
  Eigen::VectorXd gradient(n), H = hessian_values(nlp), c(nlp.num_rows());
  Eigen::VectorXd J(static_cast<Eigen::Index>(nlp.jacobian_pattern().row.size()));
  const Eigen::VectorXd weights = Eigen::VectorXd::Ones(nlp.num_rows());
  double sum = 0;
  const auto evaluate = [&] {
    nlp.move_to(delta);
    sum += nlp.cost() + nlp.gradient(gradient) + nlp.linearize(gradient, H) + nlp.largest_angle();
    nlp.constraints(c);
    sum += nlp.violation(c).size;
    nlp.constraint_jacobian(J);
    nlp.linearize_constraints(c, J);
    nlp.add_constraint_hessian(weights, J, H);
    sum += nlp.stiffness(delta, weights).along;
    nlp.exact_hessian(1.0, multipliers, H);
    nlp.reset();
    sum += nlp.linearize(gradient, H);
    nlp.move_to(delta);
    nlp.recenter();
    sum += nlp.linearize(gradient, H);
  };
  evaluate();
  EXPECT_EQ(allocations_of(evaluate), 0);
  EXPECT_TRUE(std::isfinite(sum));
}

template <template <LieGroup> class Start, LieGroup G>
void expect_forecast_without_allocation(Start<G> start, const TrackingOptions& options) {
  TrackingNoise noise(G::point_dim == 2);
  noise.constant_twist.setConstant(0.05);
  noise.constant_velocity.setConstant(0.05);
  start.covariance.setIdentity();
  std::optional<detail::TargetForecast<G>> target;
  EXPECT_EQ(allocations_of([&] { target = forecast(start, options, noise, 1.0, 4.5); }), 0);
  EXPECT_TRUE(target.has_value());
}

TEST(NoAllocation, TargetForecastDoesNotAllocate) {
  const auto check_group = []<LieGroup G>(const G& before) {
    using Point = Rn<G::point_dim>;
    typename G::Tangent way = G::Tangent::Zero();
    way[0] = 0.8;
    const G now = before * G::Exp(way);
    const Bounds<1> slow = between(0.0, 0.5);
    for (const Role role : {Role::off, Role::soft}) {
      TrackingOptions options{.non_holonomic = role, .surge = slow, .max_yaw_rate = 0.1, .limits = role};
      expect_forecast_without_allocation(detail::PoseForecastStart<G>{before, now, 1.0, {}}, options);
      expect_forecast_without_allocation(detail::TwistForecastStart<G>{now, Rn<G::dof>(way), {}}, options);
      expect_forecast_without_allocation(
          detail::PointForecastStart<G>{Point(before.translation()), Point(now.translation()), 1.0, {}}, options);
      options.model = MotionModel::damped_twist;
      expect_forecast_without_allocation(detail::PoseForecastStart<G>{before, now, 1.0, {}}, options);
    }
  };
  check_group(SE3());
  check_group(SE2());
}

}  // namespace
}  // namespace tandem::testing
