#pragma once

#include <cstdint>
#include <vector>

#include <tandem/solvers/calibration/predictive_score.hpp>

namespace tandem::detail {

/// Kinds of prediction: measurements in long or short gaps of all sensors, those of one sensor from the other ones, or
/// those ahead of an origin in time. `nothing` is the key of the solution with all measurements.
enum class FoldKind { gap, short_gap, sensor, ahead, nothing };
inline const FoldKey kNothingHeldOut = {int(FoldKind::nothing), 0, 0};

/// Measurements that are held out at once, by index.
struct Fold {
  FoldKey key;
  std::vector<std::size_t> held_out{};
  std::vector<double> weight{};  ///< 0: held out but not scored; empty: all 1
};

/// Returns the number of the block of time of a measurement, for blocks of `share` times ScoreOptions::block_length.
std::int64_t time_block(const ScoredMeasurement& m, const ScoreOptions& options, double share = 1);

/// Returns all folds for these options.
std::vector<Fold> folds_of(const std::vector<ScoredMeasurement>& all, const ScoreOptions& options);

}  // namespace tandem::detail
