#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <utility>

#include <tandem/problem/nlp_evaluator.hpp>
#include <tandem/solvers/augmented_lagrangian.hpp>
#include <tandem/solvers/fixed_lag/active_set_solve.hpp>
#include <tandem/solvers/fixed_lag/fixed_lag.hpp>
#include <tandem/solvers/fixed_lag/warm_solve.hpp>
#include <tandem/solvers/linear/hessian_diagonal.hpp>
#include <tandem/solvers/sequence.hpp>
#include <tandem/solvers/session.hpp>

namespace tandem {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// Accepted cost of elimination in order of time, relative to AMD. It puts the newest variables last, whose covariance
/// is fast.
constexpr double kTimeOrderFlops = 4;
/// Maximum number of iterations of the augmented Lagrangian, relative to that of an update.
constexpr int kGlobalIterations = 10;

/// The variables of a joint covariance that are not fixed, and the rows of their unknowns.
struct FreePart {
  std::vector<int> ids, dofs, rows;
  int size = 0;

  template <class IsFixed>
  FreePart(const std::vector<int>& all, const std::vector<int>& widths, IsFixed is_fixed) {
    for (std::size_t k = 0; k < all.size(); size += widths[k++]) {
      if (is_fixed(all[k])) continue;
      ids.push_back(all[k]);
      dofs.push_back(widths[k]);
      for (int i = 0; i < widths[k]; ++i) rows.push_back(size + i);
    }
  }
  /// Returns the covariance of all variables from that of the free ones.
  Eigen::MatrixXd with_zeros(const Eigen::MatrixXd& of_free) const {
    Eigen::MatrixXd S = Eigen::MatrixXd::Zero(size, size);
    S(rows, rows) = of_free;
    return S;
  }
};

std::string seconds(double t) {
  std::array<char, 32> text;
  std::snprintf(text.data(), text.size(), "%.9g s", t);
  return text.data();
}

}  // namespace

FixedLag::FixedLag(FixedLagOptions options) : options_(std::move(options)) {
  if (!(options_.window > 0))
    throw BadInputError("fixed-lag: window is " + seconds(options_.window) + "; it must be positive");
  if (options_.max_keyframes < 0 || options_.max_iterations < 1)
    throw BadInputError("fixed-lag: max_keyframes must not be negative, and max_iterations must be at least 1");
  if (!(options_.patience >= 0)) throw BadInputError("fixed-lag: patience must not be negative");
  if (!(options_.cost_tolerance >= 0) || !(options_.step_tolerance >= 0) || !(options_.initial_damping >= 0))
    throw BadInputError("fixed-lag: tolerances and initial_damping must not be negative");
}

double FixedLag::oldest() const {
  const auto first = std::find_if(timed_.begin(), timed_.end(), [&](const Timed& v) { return v.exists(problem_); });
  return first == timed_.end() ? -kInfinity : first->t;
}

double FixedLag::newest() const {
  const auto last = std::find_if(timed_.rbegin(), timed_.rend(), [&](const Timed& v) { return v.exists(problem_); });
  return last == timed_.rend() ? -kInfinity : last->t;
}

std::optional<std::string> FixedLag::why_too_late(double t) const {
  if (!std::isfinite(t)) return "the time of a variable is not finite";
  if (!has_marginalized_ || t >= oldest()) return {};
  return "t = " + seconds(t) + " is before the window, which begins at " + seconds(oldest()) +
         "; to accept later measurements, increase FixedLagOptions::window or max_keyframes";
}

void FixedLag::check_time(double t) const {
  if (const auto why = why_too_late(t)) throw BadInputError("fixed-lag: " + *why);
}

void FixedLag::insert(Timed variable) {
  const int id = variable.id;
  const auto same = std::find_if(timed_.begin(), timed_.end(), [&](const Timed& v) { return v.id == id; });
  if (same != timed_.end() && same->exists(problem_))
    throw BadInputError("fixed-lag: " + problem_.name(id) + " already has a time");
  if (same != timed_.end()) timed_.erase(same);  // left by a removed variable
  const auto at =
      std::upper_bound(timed_.begin(), timed_.end(), variable.t, [](double a, const Timed& b) { return a < b.t; });
  timed_.insert(at, std::move(variable));
}

/// Drops variables that were removed from the problem by other means than an update.
void FixedLag::drop_removed() {
  std::erase_if(timed_, [&](const Timed& v) { return !v.exists(problem_); });
}

Summary FixedLag::update() {
  marginalized_.clear();
  drop_removed();
  if (std::string why = why_unsupported(problem_, options_); !why.empty())
    return detail::rejection("fixed-lag", options_, std::move(why));
  Summary summary = solve_window();
  if (summary.status == Status::failed || summary.status == Status::infeasible) return summary;
  const detail::Session::Timer timer(summary.seconds);
  marginalize_before(window_begin(summary.converged() ? 1.0 : 1.0 + options_.patience));
  size_after_update_ = size();
  return summary;
}

/// Allocates the factor for the Hessian of `nlp`.
void FixedLag::Factored::prepare(const Problem& problem, const NlpEvaluator& nlp) {
  factor.emplace(nlp.hessian_pattern(), kTimeOrderFlops);
  rows = {};
  constrained.clear();
  known.assign(std::size_t(problem.id_bound()), {});
  for (int id = 0; id < problem.id_bound(); ++id)
    if (!problem.name(id).empty()) {
      const int block = nlp.block_of(id);
      known[std::size_t(id)] = {block < 0 ? kFixed : block, problem.sequence_number(id)};
    }
}

int FixedLag::Factored::block_of(const Problem& problem, int id) const {
  if (id < 0 || std::size_t(id) >= known.size()) return kUnknown;
  const Known& variable = known[std::size_t(id)];
  return variable.creation == problem.sequence_number(id) ? variable.block : kUnknown;
}

bool FixedLag::relinearize() {
  solved_.known.clear();
  extension_.clear();
  state_ = AtValues::same;
  if (!why_unsupported(problem_, options_).empty() ||
      !solved_.linearize(problem_, detail::kMinInformation, options_.threads))
    return false;
  size_after_update_ = size();
  return true;
}

bool FixedLag::Factored::evaluate(NlpEvaluator& nlp, Eigen::VectorXd& hessian, Eigen::VectorXd& diagonal,
                                  Eigen::VectorXd& jacobian) {
  Eigen::VectorXd gradient(nlp.num_unknowns());
  hessian.resize(nlp.hessian_pattern().nonzeros());
  diagonal.resize(nlp.num_unknowns());
  try {
    if (!std::isfinite(nlp.linearize(gradient, hessian))) return false;
    detail::hessian_diagonal(nlp.hessian_pattern(), hessian, diagonal);
    if (nlp.num_rows() == 0) return true;
    Eigen::VectorXd y(nlp.num_rows());
    jacobian.resize(Eigen::Index(nlp.jacobian_pattern().row.size()));
    nlp.multipliers(y);
    nlp.constraint_jacobian(jacobian);
    rows.set(nlp, jacobian, detail::ActiveRows::sides(nlp, y), diagonal);
    return true;
  } catch (const UndefinedResidualError&) {
    return false;
  }
}

bool FixedLag::Factored::linearize(Problem& problem, double damping, int threads) {
  NlpEvaluator nlp(problem);
  nlp.use_threads(threads);
  prepare(problem, nlp);
  Eigen::VectorXd hessian, diagonal, jacobian;
  const auto factorize = [&](double relative) {
    const auto shift = [relative](double d) { return d > 0 ? d * relative : detail::kMinInformation; };
    return factor->factorize(hessian, diagonal.unaryExpr(shift));
  };
  bool there = evaluate(nlp, hessian, diagonal, jacobian);
  if (there && !rows.empty()) nlp.add_constraint_hessian(rows.weights(), jacobian, hessian);
  there = there && (factorize(damping) || factorize(detail::kMinInformation) ||
                    (!rows.empty() && factorize(detail::kCovarianceDamping)));
  if (!there) known.clear();
  return there;
}

/// Computes at_values_ if state_ is `wanted` and the size of the problem has not changed since the update. Returns
/// whether it covers these variables.
bool FixedLag::linearize_at_values(const std::vector<int>& ids) const {
  const std::lock_guard lock(*mutex_);
  if (state_ == AtValues::wanted && size() == size_after_update_)
    state_ = at_values_.linearize(problem_, options_.initial_damping, options_.threads) ? AtValues::known
                                                                                        : AtValues::unavailable;
  return state_ == AtValues::known &&
         std::all_of(ids.begin(), ids.end(), [&](int id) { return at_values_.block_of(problem_, id) >= kFixed; });
}

Summary FixedLag::solve_window() {
  const auto begin = std::chrono::steady_clock::now();
  NlpEvaluator nlp(problem_);
  nlp.use_threads(options_.threads);
  solved_.prepare(problem_, nlp);
  extension_.clear();
  state_ = AtValues::same;
  Summary summary;
  try {
    if (nlp.num_rows() > 0) {
      summary = solve_constrained_window(nlp);
    } else {
      detail::WarmSolve solve(nlp, *solved_.factor, options_);
      summary = solve.run();
      if (summary.status == Status::failed || solve.damped()) solved_.known.clear();  // no covariance
      if (solve.moved()) state_ = AtValues::wanted;
    }
  } catch (...) {  // from a callback
    solved_.known.clear();
    throw;
  }
  summary.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return summary;
}

/// Solves by active sets, else by the augmented Lagrangian from the present values.
Summary FixedLag::solve_constrained_window(NlpEvaluator& nlp) {
  detail::ActiveSetSolve solve(nlp, *solved_.factor, solved_.rows, options_);
  Summary summary = solve.run();
  if (!solve.gave_up()) {
    if (summary.status == Status::failed || solve.damped()) solved_.known.clear();
    state_ = AtValues::wanted;
    return summary;
  }
  detail::Sequence sequence(options_);
  sequence.add(summary, summary.initial_cost);
  AugmentedLagrangianOptions options;
  static_cast<SolverOptions&>(options) = sequence.limits();
  options.max_iterations = kGlobalIterations * options_.max_iterations;
  options.cost_tolerance = std::min(options.cost_tolerance, options_.cost_tolerance);
  options.from_multipliers = true;
  Summary global = sequence.add(tandem::solve(problem_, options), summary.initial_cost);
  global.solver = summary.solver;
  if (global.status == Status::failed || !solved_.linearize(problem_, options_.initial_damping, options_.threads))
    solved_.known.clear();
  state_ = AtValues::wanted;
  return global;
}

/// Returns the start time of the window if its length is multiplied by `stretch`.
double FixedLag::window_begin(double stretch) const {
  double limit = newest() - stretch * options_.window;
  if (options_.max_keyframes > 0) {
    const double most = std::ceil(stretch * options_.max_keyframes);
    double begin = kInfinity;  // latest time of the keyframe
    double keyframes = 0;
    for (auto v = timed_.rbegin(); v != timed_.rend(); ++v) {
      if (begin - v->t <= kSameTime) continue;
      if (++keyframes > most) {
        limit = std::max(limit, std::nextafter(v->t, kInfinity));
        break;
      }
      begin = v->t;
    }
  }
  return limit;
}

/// Marginalizes one time after the other. The dense systems stay small, and an exception leaves a consistent state.
void FixedLag::marginalize_before(double limit) {
  std::vector<int> ids;
  while (!timed_.empty()) {
    const double t = timed_.front().t;
    const auto later = [&](const Timed& v) { return v.t - t > kSameTime; };
    const auto end = std::find_if(timed_.begin(), timed_.end(), later);
    if (!(std::prev(end)->t < limit)) break;  // a keyframe leaves as a whole
    if (options_.before_marginalize) {
      options_.before_marginalize(t);
      drop_removed();  // the callback may have removed some
    }
    const auto first = timed_.begin(), last = std::find_if(first, timed_.end(), later);
    ids.clear();
    for (auto v = first; v != last; ++v) ids.push_back(v->id);
    problem_.marginalize(ids);
    has_marginalized_ = true;
    for (auto v = first; v != last; ++v) {
      marginalized_.push_back({v->t, v->id});
      if (std::size_t(v->id) < solved_.known.size()) solved_.known[std::size_t(v->id)] = {};
    }
    timed_.erase(first, last);
  }
}

bool FixedLag::extend() {
  if (!has_covariance()) return false;
  solved_.known.resize(std::size_t(problem_.id_bound()));
  std::vector<int> added;
  for (int id = 0; id < problem_.id_bound(); ++id) {
    const int block = block_of(id);
    const bool exists = !problem_.name(id).empty(), fixed = exists && problem_.is_fixed(id);
    if (block == kUnknown) {
      if (solved_.known[std::size_t(id)].block != kUnknown) return false;  // the variable has been removed
      if (fixed) solved_.known[std::size_t(id)] = {kFixed, problem_.sequence_number(id)};
      if (exists && !fixed) added.push_back(id);
    } else if (fixed != (block == kFixed)) {
      return false;
    }
  }
  if (!extension_.extend(problem_, added,
                         [this](const auto& ids, const auto& dofs) { return linearized_covariance(ids, dofs); }))
    return false;
  for (const int id : added) solved_.known[std::size_t(id)] = {kAdded, problem_.sequence_number(id)};
  return true;
}

void FixedLag::check_known(const std::vector<int>& ids) const {
  for (const int id : ids) {
    if (id < 0 || id >= problem_.id_bound() || problem_.name(id).empty())
      throw StaleHandleError(
          "fixed-lag: the covariance is requested for a variable that is not in the problem; use IDs of variables in "
          "problem()");
    if (block_of(id) == kUnknown)
      throw NumericalError("fixed-lag: no covariance of " + problem_.name(id) +
                           ": it was not in the last update, or the update failed");
  }
}

Eigen::MatrixXd FixedLag::covariance(const std::vector<int>& ids, const std::vector<int>& dofs) const {
  check_known(ids);
  return linearize_at_values(ids) ? covariance(at_values_, ids, dofs) : linearized_covariance(ids, dofs);
}

Eigen::MatrixXd FixedLag::covariance(const Factored& from, const std::vector<int>& ids,
                                     const std::vector<int>& dofs) const {
  const std::lock_guard lock(*mutex_);
  return from.covariance(ids, dofs);
}

Eigen::MatrixXd FixedLag::linearized_covariance(const std::vector<int>& ids, const std::vector<int>& dofs) const {
  check_known(ids);
  if (std::none_of(ids.begin(), ids.end(), [&](int id) { return is_added(id); })) return covariance(solved_, ids, dofs);
  const FreePart free(ids, dofs, [this](int id) { return block_of(id) == kFixed; });
  return free.with_zeros(extension_.joint(free.ids, free.dofs, [this](const auto& known, const auto& known_dofs) {
    return linearized_covariance(known, known_dofs);
  }));
}

Eigen::MatrixXd FixedLag::Factored::covariance(const std::vector<int>& ids, const std::vector<int>& dofs) const {
  const FreePart free(ids, dofs, [this](int id) { return known[std::size_t(id)].block == kFixed; });
  if (free.ids.empty()) return free.with_zeros({});
  std::vector<int> blocks;
  for (const int id : free.ids) blocks.push_back(known[std::size_t(id)].block);
  return free.with_zeros(rows.empty() ? factor->inverse_of(blocks) : constrained.of(*factor, rows, blocks));
}

std::string why_unsupported(const Problem& problem, const FixedLagOptions&) { return detail::why_unsolvable(problem); }

}  // namespace tandem
