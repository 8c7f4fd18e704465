#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include <tandem/studies/calibration/held_out_folds.hpp>

namespace tandem {
namespace {

constexpr double kMaxSegment = 10.0;  // longest segment [s]; covers predictions across gaps as well as short ones

/// Returns the time of the first measurement and the length of the segments [s].
std::pair<double, double> segments_of(const CalibrationProblem& built, int n) {
  const auto [from, to] = built.measured_span();
  return {from, std::min(kMaxSegment, std::max((to - from) / (2 * n), 1e-3))};
}

}  // namespace

HeldOutFolds make_held_out_folds(const CalibrationProblems& problems, int n) {
  HeldOutFolds held_out;
  if (n == 0) return held_out;
  int measured = 0;
  for (const auto& built : problems)
    measured += static_cast<int>(std::count_if(built->blocks.begin(), built->blocks.end(),
                                               [](const EntryBlock& b) { return b.measured_at.has_value(); }));
  n = std::min(n, std::max(measured, 2));  // every fold has at least one measurement
  held_out.folds.resize(static_cast<std::size_t>(n));
  for (std::size_t p = 0; p < problems.size(); ++p) {
    CalibrationProblem& built = *problems[p];
    const auto [from, length] = segments_of(built, n);
    held_out.segment_length.push_back(length);
    for (const EntryBlock& b : built.blocks)
      if (b.measured_at) {
        const auto fold = std::size_t((*b.measured_at - from) / length) % held_out.folds.size();
        held_out.folds[fold].push_back({b.block, static_cast<int>(p), built.problem().loss(b.block), b.primary});
      }
  }
  return held_out;
}

bool has_untested_dead_reckoning(const CalibrationProblems& problems, const HeldOutFolds& held_out,
                                 std::vector<std::string>& notes) {
  bool any = false;
  for (std::size_t p = 0; p < problems.size() && !held_out.folds.empty(); ++p) {
    if (problems[p]->longest_without_fix <= held_out.segment_length[p]) continue;
    any = true;
    notes.push_back(fmt::format(
        "{}: the longest gap without a position fix is {:.0f} s, but held-out segments are {:.0f} s long and "
        "do not show slow errors: smaller noise of dead reckoning is not accepted",
        problems[p]->scenario, problems[p]->longest_without_fix, held_out.segment_length[p]));
  }
  return any;
}

}  // namespace tandem
