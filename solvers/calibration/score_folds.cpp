#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <span>
#include <utility>

#include <tandem/solvers/calibration/score_folds.hpp>

namespace tandem::detail {
namespace {

constexpr double kShortGap = 0.25;   // length of short gaps, relative to that of the blocks
constexpr std::size_t kOrigins = 6;  // number of origins of predictions ahead

void add_folds(const std::vector<ScoredMeasurement>& all, const ScoreOptions& options, FoldKind kind, int sensor,
               std::vector<Fold>& folds) {
  // If one sensor is held out, the others remain. A larger share of it can therefore be held out at once.
  const std::int64_t n = kind == FoldKind::sensor ? std::max(2, options.folds / 2) : options.folds;
  std::vector<Fold> group;
  for (int g = 0; g < n; ++g) group.push_back({{int(kind), sensor, g}});
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (kind == FoldKind::sensor && all[i].sensor != sensor) continue;
    const std::int64_t rest = time_block(all[i], options, kind == FoldKind::short_gap ? kShortGap : 1) % n;
    group[std::size_t(rest < 0 ? rest + n : rest)].held_out.push_back(i);
  }
  for (Fold& fold : group)
    if (!fold.held_out.empty()) folds.push_back(std::move(fold));
}

/// Adds folds for predictions ahead. Each fold has an origin in time and holds out all later measurements. The origins
/// divide the time span of each recording into equal parts. A measurement that several origins predict has a smaller
/// weight.
void add_predictions_ahead(const std::vector<ScoredMeasurement>& all, const ScoreOptions& options,
                           std::vector<Fold>& folds) {
  std::map<int, std::pair<double, double>> spans;  // by problem
  for (const ScoredMeasurement& m : all) {
    auto& [from, to] = spans.emplace(m.problem, std::pair(m.t, m.t)).first->second;
    from = std::min(from, m.t);
    to = std::max(to, m.t);
  }
  const std::size_t first = folds.size();
  std::vector<double> predictions(all.size());  // number of origins that predict each measurement
  for (std::size_t k = 1; k <= kOrigins; ++k) {
    Fold fold{{int(FoldKind::ahead), 0, static_cast<int>(k)}};
    for (std::size_t i = 0; i < all.size(); ++i) {
      const auto& [from, to] = spans.at(all[i].problem);
      const double origin = from + (to - from) * double(k) / double(kOrigins + 1);
      if (!(all[i].t > origin)) continue;
      fold.held_out.push_back(i);
      fold.weight.push_back(all[i].t <= origin + options.ahead ? 1 : 0);
      predictions[i] += fold.weight.back();
    }
    if (!fold.held_out.empty()) folds.push_back(std::move(fold));
  }
  for (Fold& fold : std::span(folds).subspan(first))
    for (std::size_t k = 0; k < fold.weight.size(); ++k)
      if (fold.weight[k] > 0) fold.weight[k] /= predictions[fold.held_out[k]];
}

}  // namespace

std::int64_t time_block(const ScoredMeasurement& m, const ScoreOptions& options, double share) {
  return std::int64_t(std::floor(m.t / (share * options.block_length)));
}

std::vector<Fold> folds_of(const std::vector<ScoredMeasurement>& all, const ScoreOptions& options) {
  std::vector<Fold> folds;
  add_folds(all, options, FoldKind::gap, 0, folds);
  add_folds(all, options, FoldKind::short_gap, 0, folds);
  std::set<int> sensors;
  for (const ScoredMeasurement& m : all) sensors.insert(m.sensor);
  if (options.by_sensor && sensors.size() > 1)
    for (const int s : sensors) add_folds(all, options, FoldKind::sensor, s, folds);
  if (options.ahead > 0) add_predictions_ahead(all, options, folds);
  return folds;
}

}  // namespace tandem::detail
