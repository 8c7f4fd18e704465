#include <cmath>
#include <numbers>

#include <Eigen/LU>

#include <tandem/problem/planning/plan_options.hpp>
#include <tandem/residuals/vehicle/inside_cone.hpp>

namespace tandem {
namespace {

std::string metres(double x) {
  std::string text = std::to_string(x);
  text.erase(text.find('.') + 3);
  return text + " m";
}

bool is_cone(const std::optional<Cone>& cone) {
  return !cone || (cone->half_angle > 0 && cone->half_angle < std::numbers::pi / 2);
}

double inside(const Cone& cone, const SE3& carrier, const SE3& other) {
  Vector<1> r;
  InsideCone<>{cone.half_angle, cone.apex, cone.point}(carrier, other, r);
  return r[0];
}

}  // namespace

double coupled_cost_weight(const PlanOptions& options, const Matrix<6, 6>& covariance_at_end) {
  constexpr double max_pull = 1e-4;  // information of the goal, relative to that of the target
  const double variance = covariance_at_end.diagonal().head<3>().maxCoeff();
  const double goal = options.terminal_position * options.terminal_position;
  return max_pull * (variance > goal ? goal / variance : 1.0);
}

double information_of_fix(const PlanOptions& options, const Matrix<6, 6>& covariance) {
  const Vector<6> by = options.fix.cwiseInverse();
  const Matrix<6, 6> gain = Matrix<6, 6>::Identity() + Matrix<6, 6>(by.asDiagonal() * covariance * by.asDiagonal());
  return 0.5 * std::log(std::max(1.0, gain.determinant()));
}

Matrix<6, 6> expected_information(const PlanOptions& options, const SE3& chaser, const SE3& target) {
  const Vector<3> p = in_sensor_frame(chaser, target, options.sight.B, options.sight.beacon);
  const double probability = Visibility{options.sight}.probability(p);
  return probability * Matrix<6, 6>(options.fix.cwiseAbs2().cwiseInverse().asDiagonal());
}

std::string why_invalid(const PlanOptions& o) {
  if (o.steps < 1) return "a plan needs at least one step, not " + std::to_string(o.steps);
  if (!(o.dt > 0) || !std::isfinite(o.dt)) return "the time step of a plan must be positive and finite";
  for (const double sigma : {o.running_position, o.running_orientation, o.terminal_position, o.terminal_orientation,
                             o.running_speed, o.running_turn_rate, o.effort, o.rate})
    if (!(sigma > 0)) return "the standard deviations of a plan's costs must be positive";
  if (!(o.information >= 0) || !std::isfinite(o.information))
    return "the cost of missed information must be finite and not negative";
  const FieldOfView& s = o.sight;
  if (!(s.range > 0 && s.range_fade > 0 && s.cosine_fade > 0 && s.half_angle > 0 && s.half_angle < std::numbers::pi) ||
      !(o.fix.array() > 0).all())
    return "sight: range, fades and fix sigmas must be positive, and the half angle between 0 and 180 degrees";
  if (!(o.keep_out >= 0)) return "the keep-out distance must not be negative";
  if (!(o.chance >= 0) || !std::isfinite(o.chance))
    return "the number of standard deviations that tighten the constraints must be finite and not negative";
  if (!is_cone(o.approach) || !is_cone(o.view)) return "the half angle of a cone must be between 0 and 90 degrees";
  if (o.lowest && o.highest && !(*o.lowest < *o.highest))
    return "depth: the minimum height must be below the maximum height";
  if (o.max_roll_pitch && !(*o.max_roll_pitch > 0 && *o.max_roll_pitch < std::numbers::pi / 2))
    return "the bound of roll and pitch must be between 0 and 90 degrees";
  if (const double distance = o.goal.translation().norm(); distance < o.keep_out)
    return "the wanted relative pose is " + metres(distance) + " from the target, inside the keep-out distance of " +
           metres(o.keep_out);
  if (o.approach && inside(*o.approach, SE3(), o.goal) < 0)
    return "the wanted relative pose is outside the approach cone, by " + metres(-inside(*o.approach, SE3(), o.goal));
  if (o.view && inside(*o.view, o.goal, SE3()) < 0)
    return "at the wanted relative pose the target is outside the field of view, by " +
           metres(-inside(*o.view, o.goal, SE3()));
  return {};
}

}  // namespace tandem
