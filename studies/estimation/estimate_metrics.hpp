#pragma once

#include <optional>
#include <string>
#include <vector>

#include <tandem/studies/scenario/scenario.hpp>

namespace tandem {

/// Description of a CSV column of name(KeyframeType).
inline constexpr const char* kKeyframeTypeColumn =
    "measurement at the keyframe: position, pose, partial (neither of them, such as a bearing) or none";

/// Errors of an estimate at one keyframe. C, T are the true poses of chaser and target, Ĉ, T̂ the estimated ones. A
/// field is absent if the truth or the measurement is.
struct KeyframeError {
  double t;  ///< s
  KeyframeType type;
  std::optional<double> position;         ///< ‖t(Ĉ⁻¹T̂) − t(C⁻¹T)‖ [m].
  std::optional<double> orientation;      ///< Angle of (Ĉ⁻¹T̂)⁻¹ C⁻¹T [deg].
  std::optional<double> raw_position;     ///< ‖z − t(C⁻¹T)‖ of the measured position z [m].
  std::optional<double> raw_orientation;  ///< Angle between the measured and the true relative rotation [deg].
  /// t(Ĉ⁻¹T̂) − t(C⁻¹T) along the chaser's axes [m].
  std::optional<Vector<3>> position_vector{};
  /// Log((R_C⁻¹ R_T)⁻¹ R̂_C⁻¹ R̂_T), about the target's axes [rad].
  std::optional<Vector<3>> rotation_vector{};
};

/// Returns the true relative position t(C⁻¹T) at time t [m], or nothing outside the time span of the truth. If the
/// truth has positions only, `chaser_rotation` (the estimate) replaces the rotation of C.
std::optional<Vector<3>> true_relative_position(const Scenario& scenario, double t, const SO3& chaser_rotation);

/// Returns the errors at all keyframes, against the interpolated truth. If it has positions only, positions are
/// compared with true_relative_position() and orientation errors are absent.
std::vector<KeyframeError> keyframe_errors(const Scenario& scenario, const std::vector<Keyframe>& keyframes,
                                           const std::vector<SE3>& chaser, const std::vector<TargetState>& target);

struct MeanStd {
  double mean, std;  ///< population standard deviation (divisor n)
  int n;
};

/// Running mean and standard deviation (Welford 1962); ignores absent values.
class Moments {
 public:
  void add(const std::optional<double>& value);
  int n() const { return n_; }
  std::optional<MeanStd> mean_std() const;  ///< absent without values

 private:
  int n_ = 0;
  double mean_ = 0.0, squares_ = 0.0;
};

/// Returns a sentence that says which truth is missing for errors of the target relative to the chaser. `compared` is
/// whether any keyframe has such an error; the text is then empty.
std::string missing_truth(const Scenario& scenario, bool compared);

/// Returns the distances between the target and its truth in the world [m] at the keyframes that the truth covers.
/// Unlike KeyframeError, they include the errors of the chaser.
std::optional<MeanStd> target_error_in_world(const Scenario& scenario, const std::vector<Keyframe>& keyframes,
                                             const std::vector<TargetState>& target);

/// Errors at one type of keyframe: a row of the paper's Table I.
struct ErrorSummary {
  int n = 0;         ///< number of keyframes
  int compared = 0;  ///< number of keyframes that the truth covers
  std::optional<MeanStd> position, orientation, raw_position, raw_orientation;  ///< fields as in KeyframeError
};

/// Summarises the errors at the keyframes of `type`, or at all keyframes.
ErrorSummary summarise(const std::vector<KeyframeError>& errors, std::optional<KeyframeType> type = {});

}  // namespace tandem
