#pragma once

#include <optional>
#include <string>
#include <vector>

#include <tandem/studies/estimation/estimate_report.hpp>

/// Parts that the report and the JSON document of an estimate share.
namespace tandem {

/// Errors at one type of keyframe, or at all keyframes.
struct EstimateErrorRow {
  std::string type;
  ErrorSummary errors;
};

/// Returns the errors at each type of keyframe and at all.
std::vector<EstimateErrorRow> error_rows(const Estimate& estimate);

/// Coverage of held-out measurements by the 95 % intervals of their predictions.
struct Coverage {
  std::string name;
  int n = 0, inliers = 0;
  int rows = 0, rows_inside = 0;  ///< rows of all inliers, and those within their 95 % interval
  int inside = 0;                 ///< inliers within their joint 95 % region
  bool inliers_known = true;      ///< if false, all measurements count as inliers

  void add(const Validation& v) {
    ++n;
    inliers_known &= v.inlier.has_value();
    if (!v.inlier.value_or(true)) return;
    ++inliers;
    rows += static_cast<int>(v.prediction.r.size());
    rows_inside += v.prediction.rows_inside();
    inside += v.prediction.inside();
  }
};

/// Returns the coverage of each sensor and, if there are several, of all together.
std::vector<Coverage> coverages(const Estimate& estimate);

/// Returns the mean NEES of the relative position (3 if consistent) if it is so large that the covariances must be too
/// small.
std::optional<double> overconfident_nees(const Estimate& estimate);

}  // namespace tandem
