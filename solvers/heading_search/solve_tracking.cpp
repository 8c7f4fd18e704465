#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <utility>
#include <vector>

#include <tandem/lie/error.hpp>
#include <tandem/problem/nlp_evaluator.hpp>
#include <tandem/solvers/assumed_range.hpp>
#include <tandem/solvers/heading_search/heading_starts.hpp>
#include <tandem/solvers/heading_search/solve_tracking.hpp>
#include <tandem/solvers/multistart.hpp>

namespace tandem {
namespace {

constexpr double kMinGap = 10.0;           // [s]; no vessel turns round unseen in less
constexpr std::size_t kMargin = 12;        // keyframes on both sides of a gap that are solved with it
constexpr double kMinRelativeGain = 1e-7;  // minimum decrease, relative to the cost of the whole problem
constexpr double kReturnAngle = 0.2;       // [rad]; a trial this close to the solution is abandoned
// Headings that differ from a solution by less than a right angle at each keyframe lead back to it. No exception is
// known.
constexpr double kSameBasin = 0.5 * std::numbers::pi;
// Limits of the excess cost of a trial. A trial may rest near a saddle: some successful ones exceed the best cost by 5
// for ten iterations and decrease by only 0.005 per iteration. The limits do not depend on the problem size, because a
// cost is a negative log probability.
constexpr double kCostMargin = 2.0, kPatience = 2000;
constexpr int kTrialIterations = 150;
constexpr std::size_t kMaxGroup = 3;              // gaps that are tried together
constexpr std::size_t kMaxBetween = 2 * kMargin;  // keyframes between two gaps that are tried together
constexpr int kMaxRounds = 3;

/// Returns candidate headings that may lead to another minimum than the present solution.
std::vector<std::vector<double>> other_headings(const TrackingProblem& tracking, const HeadingGap& gap) {
  std::vector<std::vector<double>> known = {headings(tracking, gap)};
  // Skips the reversed course if the solution follows the course. A target that goes astern is covered by the
  // interpolated headings.
  const bool ahead = fraction_aligned(known[0], candidate_headings(tracking, gap, HeadingCandidate::course)) > 0.5;
  for (const HeadingCandidate candidate : heading_candidates) {
    if (candidate == HeadingCandidate::reversed && ahead) continue;
    std::vector<double> along = candidate_headings(tracking, gap, candidate);
    const auto same = [&](const auto& other) { return max_heading_difference(other, along) < kSameBasin; };
    if (std::none_of(known.begin(), known.end(), same)) known.push_back(std::move(along));
  }
  known.erase(known.begin());
  return known;
}

using Start = std::function<void()>;

/// Searches single gaps and groups of neighbouring ones.
class Search {
 public:
  Search(TrackingProblem& tracking, const Stop& stop) : tracking_(tracking), gaps_(heading_gaps(tracking, kMinGap)) {
    result_.gaps = static_cast<int>(gaps_.size());
    if (gaps_.empty()) return;
    options_.min_gain = kMinRelativeGain * NlpEvaluator(tracking.problem).cost();
    options_.cost_margin = kCostMargin;
    options_.patience = kPatience;
    options_.max_iterations = kTrialIterations;
    options_.stop = stop;
  }

  /// Tries each gap, then groups of coupled gaps. Where that improves the solution, tries the gaps nearby again.
  HeadingSearch run() {
    std::vector<char> due(gaps_.size(), 1);
    for (int round = 0; round < kMaxRounds && std::count(due.begin(), due.end(), 1) > 0; ++round) {
      std::vector<char> next(gaps_.size(), 0);
      for (std::size_t size = 1; size <= kMaxGroup; ++size)
        for (std::size_t i = 0; i + size <= gaps_.size(); ++i) {
          if (options_.stop.reached()) break;
          const auto first = due.begin() + std::ptrdiff_t(i);
          if (std::count(first, first + std::ptrdiff_t(size), 1) == 0 || !are_coupled_in(i, size)) continue;
          if (!try_group(i, size)) continue;
          const std::size_t end = std::min(i + size + 1, gaps_.size());
          for (std::size_t k = i - std::min<std::size_t>(i, 1); k < end; ++k) next[k] = 1;
        }
      due = next;
    }
    result_.cut_short = !gaps_.empty() && options_.stop.reached();
    return result_;
  }

 private:
  bool are_coupled_in(std::size_t i, std::size_t size) const {
    for (std::size_t k = i; k + 1 < i + size; ++k)
      if (!are_coupled(tracking_, gaps_[k], gaps_[k + 1], kMaxBetween)) return false;
    return true;
  }

  /// Solves a group of gaps from other headings. Returns whether that improves the solution.
  bool try_group(std::size_t i, std::size_t size) {
    const HeadingGap all{gaps_[i].first, gaps_[i + size - 1].last};
    std::vector<Start> starts;
    for (const std::vector<double>& along : other_headings(tracking_, all))
      starts.push_back([this, all, along] { set_headings(tracking_, all, along); });
    // Other headings in both gaps of a pair, with the present ones between them.
    if (size == 2)
      for (const std::vector<double>& a : other_headings(tracking_, gaps_[i]))
        for (const std::vector<double>& b : other_headings(tracking_, gaps_[i + 1]))
          starts.push_back([this, i, a, b] {
            set_headings(tracking_, gaps_[i], a);
            set_headings(tracking_, gaps_[i + 1], b);
          });
    if (starts.empty()) return false;
    options_.has_returned = [this, all, solved = headings(tracking_, all)] {
      return max_heading_difference(solved, headings(tracking_, all)) <= kReturnAngle;
    };
    // With odometry, the chaser is hardly affected by the target's headings, and a trial without it takes half the
    // time. This does not hold for a chaser with its own sensors.
    const auto ids = gap_variables(tracking_, all, kMargin, !tracking_.ego.empty());
    const MultistartOutcome outcome = solve_part_from(starts, tracking_.problem, ids, options_);
    result_.improved += outcome.best >= 0;
    result_.gain += outcome.gain;
    return outcome.best >= 0;
  }

  TrackingProblem& tracking_;
  const std::vector<HeadingGap> gaps_;
  MultistartOptions options_;
  HeadingSearch result_;
};

}  // namespace

HeadingSearch search_headings(TrackingProblem& tracking, const Stop& stop) { return Search(tracking, stop).run(); }

void detail::report_range(TrackingProblem& tracking, const Stop& stop, Summary& summary) {
  if (!tracking.assumed_range || !summary.converged()) return;
  try {
    if (range_is_observable(tracking, Marginals(tracking.problem, {}, stop))) return;
  } catch (const Error&) {  // no covariances, or stopped
  }
  summary.unobservable.push_back({"target", {"range, which is assumed because only bearings are measured"}});
}

}  // namespace tandem
