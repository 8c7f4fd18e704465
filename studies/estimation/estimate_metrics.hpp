#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include <tandem/studies/scenario/scenario.hpp>

namespace tandem {

/// "usbl", "optical" or "gated".
std::string_view name(KeyframeType type);

/// How far an estimate is from the truth at one keyframe; a field is absent where truth or measurement is.
/// C, T are the true poses of chaser and target, Ĉ, T̂ the estimated ones.
struct KeyframeError {
  double t;  ///< s
  KeyframeType type;
  std::optional<double> position;         ///< ‖t(Ĉ⁻¹T̂) − t(C⁻¹T)‖ [m]
  std::optional<double> orientation;      ///< of (Ĉ⁻¹T̂)⁻¹ C⁻¹T [deg]
  std::optional<double> raw_position;     ///< ‖z − t(C⁻¹T)‖ of the measurement z itself [m]
  std::optional<double> raw_orientation;  ///< of a measured rotation, likewise [deg]
  /// Signed, estimate minus truth: of the position t(Ĉ⁻¹T̂) along the chaser's axes [m], and of the rotation,
  /// Log((R_C⁻¹ R_T)⁻¹ R̂_C⁻¹ R̂_T), about the target's [rad].
  std::optional<Vector<3>> position_vector{}, rotation_vector{};
};

/// t(C⁻¹T) of the truth at time t [m]. Where it has positions only, the true displacement in world axes turned by
/// `chaser_rotation`, the estimate's. Nothing where the truth does not reach.
std::optional<Vector<3>> true_relative_position(const Scenario& scenario, double t, const SO3& chaser_rotation);

/// Truth is interpolated at the keyframes. Where it has positions only, t(C⁻¹T) is that of true_relative_position, and
/// angles are absent.
std::vector<KeyframeError> keyframe_errors(const Scenario& scenario, const std::vector<Keyframe>& keyframes,
                                           const std::vector<SE3>& chaser, const std::vector<TargetState>& target);

struct MeanStd {
  double mean, std;  ///< std of the population: divided by n
  int n;
};

/// Mean and standard deviation of what is there.
class Moments {
 public:
  void add(const std::optional<double>& value);
  int n() const { return n_; }
  std::optional<MeanStd> spread() const;

 private:
  int n_ = 0;
  double mean_ = 0.0, squares_ = 0.0;  // Welford 1962
};

/// The errors of one type of keyframe, a row of the paper's Table I.
struct ErrorSummary {
  int n = 0;         ///< keyframes
  int compared = 0;  ///< those of them that the truth covers
  std::optional<MeanStd> position, orientation, raw_position, raw_orientation;
};

/// Over the keyframes of `type`, or over all of them.
ErrorSummary summarise(const std::vector<KeyframeError>& errors, std::optional<KeyframeType> type = {});

}  // namespace tandem
