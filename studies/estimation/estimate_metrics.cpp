#include <cmath>

#include <tandem/problem/navigation/trajectory.hpp>
#include <tandem/studies/estimation/estimate_metrics.hpp>
#include <tandem/studies/support/units.hpp>

namespace tandem {
namespace {

/// Returns the true rotation of the chaser, or the estimated one if the truth has positions only.
const SO3& chaser_axes(const Scenario& scenario, const SE3& truth, const SO3& estimate) {
  return scenario.truth_orientation ? truth.rotation() : estimate;
}

}  // namespace

std::optional<Vector<3>> true_relative_position(const Scenario& scenario, double t, const SO3& chaser_rotation) {
  const auto chaser = pose_at(scenario.truth_chaser, t), target = pose_at(scenario.truth_target, t);
  if (!chaser || !target) return {};
  const SO3& axes = chaser_axes(scenario, *chaser, chaser_rotation);
  return axes.inverse().act(target->translation() - chaser->translation());
}

std::vector<KeyframeError> keyframe_errors(const Scenario& scenario, const std::vector<Keyframe>& keyframes,
                                           const std::vector<SE3>& chaser, const std::vector<TargetState>& target) {
  std::vector<KeyframeError> errors;
  errors.reserve(keyframes.size());
  for (std::size_t k = 0; k < keyframes.size(); ++k) {
    const Keyframe& keyframe = keyframes[k];
    KeyframeError& error = errors.emplace_back(KeyframeError{keyframe.t, keyframe.type, {}, {}, {}, {}});
    const auto position = true_relative_position(scenario, keyframe.t, chaser[k].rotation());
    if (!position) continue;
    error.position_vector = chaser[k].inverse().act(target[k].position) - *position;
    error.position = error.position_vector->norm();
    if (keyframe.measured_position) error.raw_position = (*keyframe.measured_position - *position).norm();

    if (!scenario.truth_orientation) continue;
    const SO3 to_truth = pose_at(scenario.truth_target, keyframe.t)->rotation().inverse() *
                         pose_at(scenario.truth_chaser, keyframe.t)->rotation();  // (R_C⁻¹ R_T)⁻¹
    if (target[k].rotation) {
      error.rotation_vector = (to_truth * chaser[k].rotation().inverse() * *target[k].rotation).Log();
      error.orientation = error.rotation_vector->norm() * kDegrees;
    }
    if (keyframe.measured_rotation)
      error.raw_orientation = (to_truth * *keyframe.measured_rotation).Log().norm() * kDegrees;
  }
  return errors;
}

void Moments::add(const std::optional<double>& value) {
  if (!value) return;
  ++n_;
  const double from_mean = *value - mean_;
  mean_ += from_mean / n_;
  squares_ += from_mean * (*value - mean_);
}

std::optional<MeanStd> Moments::mean_std() const {
  if (n_ == 0) return {};
  return MeanStd{mean_, std::sqrt(squares_ / n_), n_};
}

std::string missing_truth(const Scenario& scenario, bool compared) {
  const bool chaser = !scenario.truth_chaser.empty(), target = !scenario.truth_target.empty();
  if (compared) return "";
  if (chaser && target) return "Errors are not available, because the truth covers none of the keyframes.";
  if (!chaser && !target) return "Errors are not available, because the scenario has no truth.";
  return std::string("Errors relative to the chaser are not available, because the scenario has the truth of the ") +
         (target ? "target only (no truth_chaser.tum)." : "chaser only (no truth_target.tum).");
}

std::optional<MeanStd> target_error_in_world(const Scenario& scenario, const std::vector<Keyframe>& keyframes,
                                             const std::vector<TargetState>& target) {
  Moments distances;
  for (std::size_t k = 0; k < keyframes.size(); ++k)
    if (const auto truth = pose_at(scenario.truth_target, keyframes[k].t))
      distances.add((target[k].position - truth->translation()).norm());
  return distances.mean_std();
}

ErrorSummary summarise(const std::vector<KeyframeError>& errors, std::optional<KeyframeType> type) {
  ErrorSummary summary;
  Moments position, orientation, raw_position, raw_orientation;
  for (const KeyframeError& error : errors) {
    if (type && error.type != *type) continue;
    ++summary.n;
    position.add(error.position);
    orientation.add(error.orientation);
    raw_position.add(error.raw_position);
    raw_orientation.add(error.raw_orientation);
  }
  summary.compared = position.n();
  summary.position = position.mean_std();
  summary.orientation = orientation.mean_std();
  summary.raw_position = raw_position.mean_std();
  summary.raw_orientation = raw_orientation.mean_std();
  return summary;
}

}  // namespace tandem
