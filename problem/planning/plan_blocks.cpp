#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include <tandem/problem/planning/plan_blocks.hpp>
#include <tandem/problem/planning/plan_problem.hpp>
#include <tandem/residuals/constant_twist.hpp>
#include <tandem/residuals/damped_twist.hpp>
#include <tandem/residuals/depth.hpp>
#include <tandem/residuals/prior.hpp>
#include <tandem/residuals/range.hpp>
#include <tandem/residuals/relative_pose.hpp>
#include <tandem/residuals/relative_rotation.hpp>
#include <tandem/residuals/roll_pitch.hpp>
#include <tandem/residuals/usbl_position.hpp>
#include <tandem/residuals/vehicle/inside_cone.hpp>
#include <tandem/residuals/vehicle/twist_kinematics.hpp>
#include <tandem/residuals/vehicle/visibility.hpp>
#include <tandem/residuals/with_bias.hpp>

namespace tandem::detail {
namespace {

Range<> keep_out_of(const PlanOptions& o) { return Range<>{o.keep_out}; }
InsideCone<> inside_of(const Cone& cone) { return {cone.half_angle, cone.apex, cone.point}; }

/// Returns √(J Σ Jᵀ).
double standard_deviation(const Matrix<1, 6>& J, const Matrix<6, 6>& covariance) {
  return std::sqrt(std::max(0.0, (J * covariance * J.transpose())(0, 0)));
}

/// Adds constraint ≥ margin, with the margin as a fixed variable. `from` is the body that the constraint is measured
/// from.
template <Residual R>
Block keep_inside(Problem& problem, const R& constraint, std::vector<Variable<Rn<1>>>& margins,
                  const Variable<SE3>& from, const Variable<SE3>& other) {
  margins.push_back(problem.add(Rn<1>(), "margin at step " + std::to_string(margins.size() + 1)));
  problem.fix(margins.back());
  return problem.subject_to(WithBias<R>{constraint}, at_least(0), {from, other, margins.back()});
}

}  // namespace

Block add_kinematics(Problem& problem, double dt, const PlanStep& from, const PlanStep& to) {
  return problem.subject_to(TwistKinematics<SE3>{dt}, equal_to(0), {from.chaser, from.twist, to.chaser, to.twist});
}

void add_target_motion(Problem& problem, const CoupledEstimate& estimate, double last, double dt,
                       const Variable<SE3>& before, const Variable<SE3>& now, const Variable<SE3>& next) {
  const std::tuple poses{before, now, next};
  if (estimate.time_constants) {
    const Vector<6> sigma =
        estimate.noise.cwiseProduct(DampedTwist<SE3>::noise_scale(last, dt, *estimate.time_constants));
    problem.minimize(DampedTwist<SE3>::over(last, dt, *estimate.time_constants), Gaussian(Eigen::VectorXd(sigma)),
                     poses);
  } else {
    problem.minimize(ConstantTwist<SE3>{last, dt}, Gaussian(Eigen::VectorXd(std::sqrt(dt) * estimate.noise)), poses);
  }
}

std::optional<Variable<Rn<1>>> add_goal(Problem& problem, const PlanOptions& o, int k, double cost_weight,
                                        const PlanStep& step) {
  const auto cost = [cost_weight](const Eigen::VectorXd& sigma) {
    return Gaussian(Eigen::VectorXd(sigma / std::sqrt(cost_weight)));
  };
  const bool last = k == o.steps;
  const double position = last ? o.terminal_position : o.running_position;
  const double orientation = last ? o.terminal_orientation : o.running_orientation;
  problem.minimize(UsblPosition<>{o.goal.translation()}, cost(Eigen::Vector3d::Constant(position)),
                   {step.target, step.chaser});
  problem.minimize(RelativeRotation<>{o.goal.rotation()}, cost(Eigen::Vector3d::Constant(orientation)),
                   {step.target, step.chaser});
  std::optional<Variable<Rn<1>>> gain;
  if (o.information > 0) {
    gain = problem.add(Rn<1>(), "information at step " + std::to_string(k));
    problem.fix(*gain);
    problem.minimize(Visibility{o.sight}, cost(Vector<1>(1.0 / std::sqrt(o.information))),
                     {step.chaser, step.target, *gain});
  }
  Vector<6> speed;
  speed << Vector<3>::Constant(o.running_speed), Vector<3>::Constant(o.running_turn_rate);
  problem.minimize(RelativePose<Rn<6>>{}, cost(speed), {step.target_twist, step.twist});
  return gain;
}

void add_limits(Problem& problem, const PlanOptions& o, const PlanStep& step, PlanMargins& margins,
                std::vector<Block>& hard) {
  constexpr double none = std::numeric_limits<double>::infinity();
  if (o.twist) hard.push_back(problem.subject_to(Prior<Rn<6>>{}, *o.twist, {step.twist}));
  if (o.lowest || o.highest)
    hard.push_back(
        problem.subject_to(Depth{0.0}, between(o.lowest.value_or(-none), o.highest.value_or(none)), {step.chaser}));
  if (o.max_roll_pitch)
    hard.push_back(problem.subject_to(RollPitch<>{}, between(-*o.max_roll_pitch, *o.max_roll_pitch), {step.chaser}));
  if (o.keep_out > 0) hard.push_back(keep_inside(problem, keep_out_of(o), margins.keep_out, step.chaser, step.target));
  if (o.approach)
    hard.push_back(keep_inside(problem, inside_of(*o.approach), margins.approach, step.target, step.chaser));
  if (o.view) hard.push_back(keep_inside(problem, inside_of(*o.view), margins.view, step.chaser, step.target));
}

void set_margins(Problem& problem, const PlanOptions& options, std::span<const Variable<SE3>> chasers,
                 std::span<const Variable<SE3>> targets, std::span<const Matrix<6, 6>> covariance,
                 const PlanMargins& margins) {
  const auto set = [&](const auto& margin, std::size_t k, const auto& constraint, const SE3& from, const SE3& other,
                       bool from_target) {
    if (margin.empty()) return;
    Vector<1> c;
    Matrix<1, 6> by_target;
    constraint(from, other, c, from_target ? &by_target : nullptr, from_target ? nullptr : &by_target);
    const double sigma = standard_deviation(by_target, covariance[k]);
    problem.set_value(margin[k - 1], Rn<1>(Vector<1>(-options.chance * sigma)));
  };
  for (std::size_t k = 1; k < targets.size(); ++k) {
    const SE3 &chaser = problem.value(chasers[k]), &target = problem.value(targets[k]);
    set(margins.keep_out, k, keep_out_of(options), chaser, target, false);
    if (options.approach) set(margins.approach, k, inside_of(*options.approach), target, chaser, true);
    if (options.view) set(margins.view, k, inside_of(*options.view), chaser, target, false);
  }
}

}  // namespace tandem::detail
