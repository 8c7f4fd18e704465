#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include <tandem/studies/calibration/held_out_stretches.hpp>

namespace tandem {
namespace {

constexpr double kStretch = 10.0;  // s that are held out at once: predictions across a gap count as those at hand do

/// Of a problem's measurements, the first time [s] and how long each stretch is that is held out at once.
std::pair<double, double> stretches_of(const CalibrationProblem& built, int n) {
  double from = HUGE_VAL, to = -HUGE_VAL;
  for (const EntryBlock& b : built.blocks)
    if (b.measured_at) {
      from = std::min(from, *b.measured_at);
      to = std::max(to, *b.measured_at);
    }
  return {from, std::min(kStretch, std::max((to - from) / (2 * n), 1e-3))};
}

}  // namespace

HeldOutStretches held_out_stretches(const CalibrationProblems& problems, int n) {
  HeldOutStretches held_out;
  if (n == 0) return held_out;
  int measured = 0;
  for (const auto& built : problems)
    measured += static_cast<int>(std::count_if(built->blocks.begin(), built->blocks.end(),
                                               [](const EntryBlock& b) { return b.measured_at.has_value(); }));
  n = std::min(n, std::max(measured, 2));  // one each then
  held_out.folds.resize(static_cast<std::size_t>(n));
  for (std::size_t p = 0; p < problems.size(); ++p) {
    CalibrationProblem& built = *problems[p];
    const auto [from, stretch] = stretches_of(built, n);
    held_out.seconds.push_back(stretch);
    for (const EntryBlock& b : built.blocks)
      if (b.measured_at) {
        const auto fold = std::size_t((*b.measured_at - from) / stretch) % held_out.folds.size();
        held_out.folds[fold].push_back({b.block, static_cast<int>(p), built.problem().loss(b.block), b.whole});
      }
  }
  return held_out;
}

bool reckons_untried(const CalibrationProblems& problems, const HeldOutStretches& held_out,
                     std::vector<std::string>& held) {
  bool any = false;
  for (std::size_t p = 0; p < problems.size() && !held_out.folds.empty(); ++p) {
    if (problems[p]->longest_without_fix <= held_out.seconds[p]) continue;
    any = true;
    held.push_back(
        fmt::format("{}: {:.0f} s without a fix of the position, when {:.0f} s are held out at once, which do not show "
                    "errors that stay: less noise than given is not believed of what the position rests on meanwhile",
                    problems[p]->scenario, problems[p]->longest_without_fix, held_out.seconds[p]));
  }
  return any;
}

}  // namespace tandem
