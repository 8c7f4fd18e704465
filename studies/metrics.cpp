#include <cmath>
#include <numbers>

#include <tandem/problem/trajectory.hpp>
#include <tandem/studies/metrics.hpp>

namespace tandem {
namespace {

double degrees_between(const SO3& a, const SO3& b) { return (a.inverse() * b).Log().norm() * 180.0 / std::numbers::pi; }

/// Mean and standard deviation of what is there.
class Moments {
 public:
  void add(const std::optional<double>& value) {
    if (!value) return;
    ++n_;
    const double from_mean = *value - mean_;
    mean_ += from_mean / n_;
    squares_ += from_mean * (*value - mean_);
  }
  int n() const { return n_; }
  std::optional<MeanStd> spread() const {
    if (n_ == 0) return {};
    return MeanStd{mean_, std::sqrt(squares_ / n_), n_};
  }

 private:
  int n_ = 0;
  double mean_ = 0.0, squares_ = 0.0;  // Welford 1962
};

}  // namespace

std::string_view name(KeyframeType type) {
  switch (type) {
    case KeyframeType::usbl:
      return "usbl";
    case KeyframeType::optical:
      return "optical";
    case KeyframeType::gated:
      break;
  }
  return "gated";
}

std::vector<KeyframeError> keyframe_errors(const Scenario& scenario, const std::vector<Keyframe>& keyframes,
                                           const std::vector<SE3>& chaser, const std::vector<SE3>& target) {
  std::vector<KeyframeError> errors;
  errors.reserve(keyframes.size());
  for (std::size_t k = 0; k < keyframes.size(); ++k) {
    const Keyframe& keyframe = keyframes[k];
    KeyframeError& error = errors.emplace_back(KeyframeError{keyframe.t, keyframe.type, {}, {}, {}, {}});
    const auto true_chaser = pose_at(scenario.truth_chaser, keyframe.t);
    const auto true_target = pose_at(scenario.truth_target, keyframe.t);
    if (!true_chaser || !true_target) continue;

    const SO3& axes = scenario.truth_orientation ? true_chaser->rotation() : chaser[k].rotation();
    const Vector<3> position = axes.inverse().act(true_target->translation() - true_chaser->translation());
    const SE3 estimated = chaser[k].inverse() * target[k];
    error.position = (estimated.translation() - position).norm();
    if (keyframe.measured_position) error.raw_position = (*keyframe.measured_position - position).norm();

    if (!scenario.truth_orientation) continue;
    const SO3 rotation = axes.inverse() * true_target->rotation();
    error.angle = degrees_between(estimated.rotation(), rotation);
    if (keyframe.measured_rotation) error.raw_angle = degrees_between(*keyframe.measured_rotation, rotation);
  }
  return errors;
}

ErrorSummary summarise(const std::vector<KeyframeError>& errors, std::optional<KeyframeType> type) {
  ErrorSummary summary;
  Moments position, angle, raw_position, raw_angle;
  for (const KeyframeError& error : errors) {
    if (type && error.type != *type) continue;
    ++summary.n;
    position.add(error.position);
    angle.add(error.angle);
    raw_position.add(error.raw_position);
    raw_angle.add(error.raw_angle);
  }
  summary.compared = position.n();
  summary.position = position.spread();
  summary.angle = angle.spread();
  summary.raw_position = raw_position.spread();
  summary.raw_angle = raw_angle.spread();
  return summary;
}

}  // namespace tandem
