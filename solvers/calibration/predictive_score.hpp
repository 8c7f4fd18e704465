#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <tuple>
#include <vector>

#include <tandem/problem/problem.hpp>
#include <tandem/problem/stop.hpp>
#include <tandem/solvers/calibration/saved_values.hpp>

namespace tandem {

/// Consecutive rows of a residual block that are scored together.
struct ScoredRows {
  int first = 0, count = 0;
  /// Ratio of the measurement's noise variance to that of the block; below 1 if the measurement is split over blocks.
  double noise_share = 1;
};

/// A measurement that predictive_score() holds out and predicts.
struct ScoredMeasurement {
  Block block;
  int problem = 0;                  ///< index of its problem among those that are scored together
  int sensor = 0;                   ///< number of its sensor; the same in all models that are compared
  double t = 0;                     ///< time stamp [s]; the same in all models
  std::vector<ScoredRows> parts{};  ///< empty: held out with the others, but not scored
};

/// Identifies measurements that are held out at once: kind of the prediction, sensor, and group of time blocks.
using FoldKey = std::tuple<int, int, int>;
/// Values of the problems without the measurements of each fold, and with all measurements.
using FoldSolutions = std::map<FoldKey, std::vector<detail::SavedValues>>;

struct ScoreOptions {
  /// Length of the blocks of time [s], positive. Errors must not be correlated for longer, or they leak from one block
  /// to the next; see score_block_length().
  double block_length = 0;
  int folds = 5;          ///< number of groups of blocks; each group is held out at once
  int every = 1;          ///< predicts only every n-th group, and less accurately, for a quick look at many models
  bool by_sensor = true;  ///< also predicts each sensor from the others, if there are several
  double ahead = 0;       ///< if positive, also predicts this time ahead from earlier measurements only [s]
  /// Solutions of a similar model. A fold starts from there, or from the solution of all measurements moved as theirs
  /// moves without the fold, if the cost is lower. Must outlive the call.
  const FoldSolutions* start = nullptr;
  Stop stop{};  ///< ends the computation with Stopped
};

/// Predictive density of some rows of a held-out measurement.
struct ScoredPart {
  /// Identifies a prediction: fold, problem, sensor, time [µs], part, and number among equal ones.
  using Key = std::tuple<FoldKey, int, int, std::int64_t, int, int>;
  Key key;
  std::int64_t time_block = 0;
  double log_density = 0;       ///< natural logarithm; weighted, so that each measurement counts once in total
  double squared_distance = 0;  ///< rᵀ S⁻¹ r of the residual, with S the predicted covariance including the noise
  int rows = 0;
};

/// Share of the held-out parts inside of their intervals of probability kCoverageLevels.
struct Coverage {
  double share = 0;
  double standard_error = 0;  ///< from its variation over the blocks of time, which accounts for correlation
};
inline constexpr std::array kCoverageLevels = {0.5, 0.95, 0.99};

struct PredictiveScore {
  std::vector<ScoredPart> parts;  ///< in the order of their keys
  FoldSolutions solutions;        ///< for ScoreOptions::start
  std::string why;                ///< the reason if the problems or a fold could not be solved; then `parts` is empty

  bool valid() const { return why.empty(); }
  double total() const;  ///< sum of the log densities
  std::array<Coverage, kCoverageLevels.size()> coverage() const;
};

/// Difference of two scores.
struct ScoreGain {
  double gain = 0;
  double standard_error = 0;  ///< from the variation over the blocks of time
  int blocks = 0;             ///< number of blocks of time with measurements
};

/// Scores a model by its predictions of held-out measurements.
///
/// The measurements are held out in blocks of time, a group of blocks at once, and predicted from all others: across
/// gaps of all sensors of the block length and of a quarter of it; with `by_sensor`, each sensor also from the other
/// ones; with `ahead`, also from earlier measurements only. The log densities of these kinds are averaged.
///
/// The density is Student's t with 4 degrees of freedom, so that a few outliers do not dominate the score. Its scale
/// matrix is the predicted covariance, multiplied by a factor with which the expected score of Gaussian errors is
/// largest for the right covariance. The density does not depend on the losses of the model, so models with different
/// losses are comparable.
///
/// The problems are solved first, and are left solved with all measurements. They may not be used by other threads
/// meanwhile. If a solve fails, the score is invalid with the reason. Throws BadInputError on invalid options or
/// blocks, and Stopped.
PredictiveScore predictive_score(std::span<Problem* const> problems, const std::vector<ScoredMeasurement>& measurements,
                                 const ScoreOptions& options);

/// Returns the score on the measurements of `reference`. A measurement that only the reference has gets the density of
/// the reference, so a model neither gains nor loses by discarding measurements.
PredictiveScore completed(PredictiveScore score, const PredictiveScore& reference);

/// Returns the gain of b over a. Both must be completed() by the same reference, or predict the same measurements.
ScoreGain score_gain(const PredictiveScore& a, const PredictiveScore& b);

/// Returns the length of blocks of time [s] for residuals with this correlation time. It is three correlation times, or
/// the longest gap between the measurement times if that is longer, because models are used to fill such gaps. It is
/// short enough for eight blocks in the recording, but at least twice the median step. Returns 0 if the recording is
/// too short for five blocks of this minimum length.
double score_block_length(double correlation_time, std::vector<double> times);

namespace detail {

/// Returns the log density of a residual by the predicted covariance; see predictive_score().
double robust_log_density(double squared_distance, double log_determinant, int rows);

}  // namespace detail
}  // namespace tandem
