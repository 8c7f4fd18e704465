#include <algorithm>
#include <cmath>
#include <vector>

#include <fmt/format.h>

#include <tandem/residuals/roll_pitch.hpp>
#include <tandem/studies/estimation/target_constraints.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

/// Adds a quantity that exceeds its bounds by `outside`.
void add(ConstraintCheck& check, double outside, double sigma) {
  check.violation = std::max(check.violation, std::abs(outside));
  check.cost += 0.5 * outside * outside / (sigma * sigma);
}

double outside(double value, double lower, double upper) { return value - std::clamp(value, lower, upper); }

}  // namespace

TargetConstraints constraints_of(const TrackingOptions& options) {
  return {options.non_holonomic != Role::off, options.roll_pitch == Role::hard, options.surge, options.max_yaw_rate};
}

TrackingOptions with_constraints(TrackingOptions options, const TargetConstraints& constraints, Role role) {
  options.non_holonomic = constraints.non_holonomic ? role : Role::off;
  if (constraints.roll_pitch) options.roll_pitch = role;
  options.limits = role == Role::off ? Role::hard : role;
  options.surge = role == Role::off ? std::nullopt : constraints.surge;
  options.max_yaw_rate = role == Role::off ? std::nullopt : constraints.max_yaw_rate;
  return options;
}

std::string describe(const TargetConstraints& constraints) {
  std::vector<std::string> parts;
  if (constraints.non_holonomic) parts.push_back("non-holonomic");
  if (constraints.surge) {
    const double lower = constraints.surge->lower[0], upper = constraints.surge->upper[0];
    parts.push_back(!std::isfinite(upper)   ? fmt::format("surge ≥ {} m/s", lower)
                    : !std::isfinite(lower) ? fmt::format("surge ≤ {} m/s", upper)
                                            : fmt::format("surge within {} … {} m/s", lower, upper));
  }
  if (constraints.max_yaw_rate) parts.push_back(fmt::format("yaw rate within ±{} rad/s", *constraints.max_yaw_rate));
  if (constraints.roll_pitch) parts.push_back("roll and pitch zero");
  return listed(parts);
}

ConstraintCheck check(const TrackingProblem& tracking, const TrackingNoise& noise,
                      const TargetConstraints& constraints) {
  ConstraintCheck result;
  std::optional<SE3> before;  // pose at the previous keyframe
  for (std::size_t k = 0; k < tracking.keyframes.size(); ++k) {
    const TargetState state = tracking.target_state(k);
    std::optional<SE3> pose;
    if (state.rotation) pose = SE3(*state.rotation, state.position);
    if (pose && constraints.roll_pitch) {
      Vector<2> r;
      RollPitch<SE3>{}(*pose, r);
      for (int i = 0; i < 2; ++i) add(result, r[i], noise.roll_pitch[i]);
    }
    if (before && pose) {
      const double dt = tracking.keyframes[k].t - tracking.keyframes[k - 1].t;
      const Vector<6> twist = (before->inverse() * *pose).Log() / dt;
      if (constraints.non_holonomic)
        for (int i = 0; i < 2; ++i) add(result, twist[1 + i], noise.non_holonomic[i]);  // sway, heave
      if (constraints.surge)
        add(result, outside(twist[0], constraints.surge->lower[0], constraints.surge->upper[0]), noise.surge);
      if (constraints.max_yaw_rate)
        add(result, outside(twist[5], -*constraints.max_yaw_rate, *constraints.max_yaw_rate), noise.yaw_rate);
    }
    before = pose;
  }
  return result;
}

LimitCheck count_outside(const TrackingProblem& tracking, const TrackingNoise& noise, const TargetConstraints& limits) {
  constexpr double kMinSigmas = 3;
  LimitCheck result;
  for (std::size_t k = 1; k < tracking.keyframes.size(); ++k) {
    const TargetState from = tracking.target_state(k - 1), to = tracking.target_state(k);
    if (!from.rotation || !to.rotation) continue;
    const double dt = tracking.keyframes[k].t - tracking.keyframes[k - 1].t;
    const Vector<6> twist = (SE3(*from.rotation, from.position).inverse() * SE3(*to.rotation, to.position)).Log() / dt;
    bool is_outside = false;
    if (limits.surge)
      is_outside |=
          std::abs(outside(twist[0], limits.surge->lower[0], limits.surge->upper[0])) > kMinSigmas * noise.surge;
    if (limits.max_yaw_rate)
      is_outside |=
          std::abs(outside(twist[5], -*limits.max_yaw_rate, *limits.max_yaw_rate)) > kMinSigmas * noise.yaw_rate;
    result.outside += is_outside;
    ++result.intervals;
  }
  return result;
}

}  // namespace tandem
