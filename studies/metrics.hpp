#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include <tandem/studies/scenario.hpp>

namespace tandem {

/// "usbl", "optical" or "gated".
std::string_view name(KeyframeType type);

/// How far an estimate is from the truth at one keyframe; a field is absent where truth or measurement is.
/// C, T are the true poses of chaser and target, Ĉ, T̂ the estimated ones.
struct KeyframeError {
  double t;  ///< s
  KeyframeType type;
  std::optional<double> position;      ///< ‖t(Ĉ⁻¹T̂) − t(C⁻¹T)‖ [m]
  std::optional<double> angle;         ///< of (Ĉ⁻¹T̂)⁻¹ C⁻¹T [deg]
  std::optional<double> raw_position;  ///< ‖z − t(C⁻¹T)‖ of the measurement z itself [m]
  std::optional<double> raw_angle;     ///< of a measured rotation, likewise [deg]
};

/// Truth is interpolated at the keyframes. Where it has positions only, t(C⁻¹T) is the true displacement in
/// world axes turned by the estimated orientation of the chaser, and angles are absent.
std::vector<KeyframeError> keyframe_errors(const Scenario& scenario, const std::vector<Keyframe>& keyframes,
                                           const std::vector<SE3>& chaser, const std::vector<SE3>& target);

struct MeanStd {
  double mean, std;  ///< std of the population: divided by n
  int n;
};

/// The errors of one type of keyframe, a row of the paper's Table I.
struct ErrorSummary {
  int n = 0;         ///< keyframes
  int compared = 0;  ///< those of them that the truth covers
  std::optional<MeanStd> position, angle, raw_position, raw_angle;
};

/// Over the keyframes of `type`, or over all of them.
ErrorSummary summarise(const std::vector<KeyframeError>& errors, std::optional<KeyframeType> type = {});

}  // namespace tandem
