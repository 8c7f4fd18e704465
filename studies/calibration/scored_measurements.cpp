#include <algorithm>

#include <tandem/studies/calibration/misfit.hpp>
#include <tandem/studies/calibration/scored_measurements.hpp>

namespace tandem {
namespace {

/// Returns the parts of a block whose rows start at row b.first of its entry.
std::vector<ScoredRows> parts_of(const CalibratedEntry& entry, const EntryBlock& b, int rows) {
  std::vector<ScoredRows> parts;
  const bool pose = entry.kind == name(SensorType::pose);
  const int rotation = static_cast<int>(std::count(entry.angle.begin(), entry.angle.end(), false));
  const int split = pose ? std::clamp(rotation - b.first, 0, rows) : rows;
  if (split > 0) parts.push_back({0, split, b.shared == split ? b.share : 1});
  if (split < rows) parts.push_back({split, rows - split});
  return parts;
}

}  // namespace

std::vector<ScoredMeasurement> scored_measurements(const CalibrationProblems& problems) {
  std::vector<ScoredMeasurement> all;
  for (std::size_t p = 0; p < problems.size(); ++p)
    for (const EntryBlock& b : problems[p]->blocks) {
      if (!b.measured_at) continue;
      ScoredMeasurement& m =
          all.emplace_back(ScoredMeasurement{b.block, static_cast<int>(p), static_cast<int>(b.entry), *b.measured_at});
      const int rows = static_cast<int>(problems[p]->problem().noise(b.block).dim());
      if (b.primary) m.parts = parts_of(problems[p]->entries[b.entry], b, rows);
    }
  return all;
}

double held_out_block_length(const CalibrationProblems& problems, const Stop& stop) {
  double longest = 0;
  for (const auto& problem : problems)
    for (const Misfit& m : misfits(*problem, stop)) longest = std::max(longest, m.correlation_time());
  double length = 0;
  for (const auto& problem : problems) {
    std::vector<double> times;
    for (const EntryBlock& b : problem->blocks)
      if (b.measured_at) times.push_back(*b.measured_at);
    const double own = score_block_length(longest, std::move(times));
    if (!(own > 0)) return 0;
    length = std::max(length, own);
  }
  return length;
}

double held_out_time_ahead(const CalibrationProblems& problems, double block_length) {
  double ahead = 0;
  for (const auto& problem : problems) {
    const auto [from, to] = problem->measured_span();
    if (to > from) ahead = std::max(ahead, std::min(problem->longest_without_target_position, (to - from) / 2));
  }
  return ahead > block_length ? ahead : 0;
}

}  // namespace tandem
