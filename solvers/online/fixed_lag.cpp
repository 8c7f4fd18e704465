#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include <tandem/problem/program.hpp>
#include <tandem/solvers/linear/hessian_diagonal.hpp>
#include <tandem/solvers/online/fixed_lag.hpp>
#include <tandem/solvers/session.hpp>

namespace tandem {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kRefusedDamping = 1e-6;  // the least after a step that was refused
constexpr double kFreeDamping = 1e-4;     // steps damped more than this are short for that reason
constexpr double kMaxDamping = 1e12;
constexpr double kCovarianceDamping = 1e-10;  // more than this shows in the covariance

/// Levenberg–Marquardt for a problem that is nearly solved when it begins and done after a step or two: what costs no
/// less than a step (observability, curvature learned from past steps, a last linearisation) is left out.
class WarmSolve {
 public:
  WarmSolve(Program& program, BlockCholesky& cholesky, const FixedLagOptions& options)
      : options_(options),
        program_(program),
        cholesky_(cholesky),
        session_("fixed-lag", options),
        damping_(options.initial_damping),
        gradient_(program.num_unknowns()),
        hessian_(static_cast<Eigen::Index>(program.hessian_pattern().row.size())),
        scale_(program.num_unknowns()),
        shift_(program.num_unknowns()),
        step_(program.num_unknowns()) {}

  Summary run() {
    auto& s = session_.summary;
    if (session_.start(program_, [this] { return linearize(); })) iterate();
    program_.reset();
    if (s.status != Status::failed && damped_) {  // the covariance is of the problem, not of a damped one
      linearize();
      damping_ = options_.initial_damping;
      damped_ = !factorize();
    }
    return s;
  }
  /// Whether the factor is not that of the problem itself.
  bool damped() const { return damped_; }

 private:
  double linearize() {
    const detail::Session::Timer timer(session_.summary.evaluation_seconds);
    ++session_.summary.evaluations;
    const double cost = program_.linearize(gradient_, hessian_);
    detail::hessian_diagonal(program_.hessian_pattern(), hessian_, scale_);
    return cost;
  }

  void iterate() {
    auto& s = session_.summary;
    while (!session_.ended()) {
      if (!std::isfinite(gradient_.sum()) || !std::isfinite(scale_.sum())) {
        session_.end(Status::failed, "a Jacobian is not finite, in " + program_.describe_bad_block());
        return;
      }
      session_.report(s.iterations, s.cost, s.iterations ? step_.norm() : 0.0, 0.0);
      if (session_.should_stop()) return;
      if (s.iterations >= options_.max_iterations) {
        session_.end(Status::max_iterations);
        return;
      }
      ++s.iterations;
      if (!find_step()) return;
      try_step();
    }
  }

  /// The step, by the least damping from damping_ on with which the Hessian is positive definite.
  bool find_step() {
    const detail::Session::Timer timer(session_.summary.linear_solver_seconds);
    for (;; damping_ = 100 * std::max(damping_, 1e-12)) {
      if (damping_ > kMaxDamping) {
        session_.end(Status::failed, "no step lowers the cost, however short: is a Jacobian wrong?");
        return false;
      }
      if (factorize()) break;
    }
    damped_ = damping_ > std::max(kCovarianceDamping, options_.initial_damping);
    step_ = -gradient_;
    cholesky_.solve(step_);
    predicted_ = 0.5 * (step_.cwiseAbs2().dot(shift_) - gradient_.dot(step_));
    return true;
  }

  bool factorize() {
    // An unknown that no residual curves still gets a pivot, and then no step.
    for (Eigen::Index i = 0; i < shift_.size(); ++i)
      shift_[i] = scale_[i] > 0 ? std::max(damping_ * scale_[i], std::numeric_limits<double>::min()) : 1.0;
    return cholesky_.factorize(hessian_, shift_);
  }

  double cost_at_step() {
    const detail::Session::Timer timer(session_.summary.evaluation_seconds);
    ++session_.summary.evaluations;
    try {
      program_.move_to(step_);
      return program_.cost();
    } catch (const Error&) {
      return kInfinity;  // undefined there: shorten the step
    }
  }

  void try_step() {
    auto& s = session_.summary;
    const double least = options_.cost_tolerance * std::max(1.0, s.cost);
    const double trial = cost_at_step(), drop = s.cost - trial;
    const bool free_step = damping_ <= std::max(kFreeDamping, options_.initial_damping);
    const bool last = free_step && predicted_ <= std::max(least, 1e-14 * s.cost);
    if (!(drop > 1e-4 * predicted_)) {
      if (last) {  // it had nothing to gain but rounding
        if (drop >= 0) accept(trial);
        return session_.end(Status::converged, "the cost changes no more");
      }
      program_.reset();
      damping_ = growth_ * std::max(damping_, kRefusedDamping);
      growth_ *= 4;
      return;
    }
    accept(trial);
    damping_ = std::max(options_.initial_damping, damping_ * std::max(0.1, 1 - std::pow(2 * drop / predicted_ - 1, 3)));
    growth_ = 10;
    if (last) {
      session_.end(Status::converged, "the cost changes no more");
    } else if (free_step && std::abs(drop - predicted_) <= least) {
      session_.end(Status::converged, "the cost fell as foretold: another step has nothing left to gain");
    } else if (free_step && step_.cwiseAbs().maxCoeff() <= options_.step_tolerance) {
      session_.end(Status::converged, "the steps have become too small to matter");
    } else if (s.iterations < options_.max_iterations) {
      linearize();
    }
  }

  void accept(double cost) {
    program_.recenter();
    session_.summary.cost = cost;
  }

  const FixedLagOptions& options_;
  Program& program_;
  BlockCholesky& cholesky_;
  detail::Session session_;
  double damping_, growth_ = 10, predicted_ = 0;
  bool damped_ = false;
  Eigen::VectorXd gradient_, hessian_, scale_, shift_, step_;
};

std::string seconds(double t) {
  std::array<char, 32> text;
  std::snprintf(text.data(), text.size(), "%.9g s", t);
  return text.data();
}

}  // namespace

FixedLag::FixedLag(FixedLagOptions options) : options_(std::move(options)) {
  if (!(options_.window > 0)) throw Error("fixed-lag: the window of " + seconds(options_.window) + " is not positive");
  if (options_.max_keyframes < 0 || options_.max_iterations < 1)
    throw Error("fixed-lag: max_keyframes must not be negative, max_iterations not below 1");
  if (!(options_.cost_tolerance >= 0) || !(options_.step_tolerance >= 0) || !(options_.initial_damping >= 0))
    throw Error("fixed-lag: tolerances and initial_damping must not be negative");
}

double FixedLag::oldest() const { return timed_.empty() ? -kInfinity : timed_.front().t; }
double FixedLag::newest() const { return timed_.empty() ? -kInfinity : timed_.back().t; }

std::optional<std::string> FixedLag::why_too_late(double t) const {
  if (!slid_ || t >= oldest()) return {};
  return "t = " + seconds(t) + " is too late: the window has moved on and begins at " + seconds(oldest()) +
         " (to wait longer, widen it by FixedLagOptions::window or max_keyframes)";
}

void FixedLag::check_time(double t) const {
  if (!std::isfinite(t)) throw Error("fixed-lag: the time of a variable is not finite");
  if (const auto why = why_too_late(t)) throw Error("fixed-lag: " + *why);
}

void FixedLag::insert(double t, int id) {
  timed_.insert(std::upper_bound(timed_.begin(), timed_.end(), t, [](double a, const Timed& b) { return a < b.t; }),
                {t, id});
  forget(id);
}

/// The id is of no variable of the last update.
void FixedLag::forget(int id) {
  if (std::size_t(id) < block_of_variable_.size()) block_of_variable_[std::size_t(id)] = kUnknown;
}

Summary FixedLag::update() {
  gone_.clear();
  if (std::string why = why_unsupported(problem_, options_); !why.empty())
    return detail::refusal("fixed-lag", options_, std::move(why));
  Summary summary = solve_window();
  if (summary.status == Status::failed) return summary;
  const detail::Session::Timer timer(summary.seconds);
  marginalize_old();
  return summary;
}

Summary FixedLag::solve_window() {
  const auto begin = std::chrono::steady_clock::now();
  Program program(problem_);
  factor_.emplace(program.hessian_pattern());
  block_of_variable_.assign(std::size_t(problem_.id_bound()), kUnknown);
  for (int id = 0; id < problem_.id_bound(); ++id)
    if (!problem_.name(id).empty()) {
      const int block = program.block_of(id);
      block_of_variable_[std::size_t(id)] = block < 0 ? kFixed : block;
    }
  WarmSolve solve(program, *factor_, options_);
  Summary summary = solve.run();
  if (summary.status == Status::failed || solve.damped()) block_of_variable_.clear();  // no covariance
  summary.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return summary;
}

/// One time after the other: the dense systems stay small however much is old.
void FixedLag::marginalize_old() {
  double limit = newest() - options_.window;
  if (options_.max_keyframes > 0) {
    double begin = kInfinity;  // of the keyframe, from its latest time back
    int keyframes = 0;
    for (auto v = timed_.rbegin(); v != timed_.rend(); ++v) {
      if (begin - v->t <= kSameTime) continue;
      if (++keyframes > options_.max_keyframes) {
        limit = std::max(limit, std::nextafter(v->t, kInfinity));
        break;
      }
      begin = v->t;
    }
  }
  auto first = timed_.begin();
  std::vector<int> ids;
  while (first != timed_.end()) {
    const double t = first->t;
    const auto end = std::find_if(first, timed_.end(), [&](const Timed& v) { return v.t - t > kSameTime; });
    if (!(std::prev(end)->t < limit)) break;  // a keyframe goes as one
    ids.clear();
    for (; first != end; ++first) {
      ids.push_back(first->id);
      gone_.push_back({first->t, first->id});
      forget(first->id);
    }
    if (options_.leaving) options_.leaving(t);
    problem_.marginalize(ids);
    slid_ = true;
  }
  timed_.erase(timed_.begin(), first);
}

void FixedLag::check_known(const std::vector<int>& ids) const {
  for (const int id : ids) {
    if (id < 0) throw Error("fixed-lag: covariance of a variable that is not in the problem (any more)");
    if (std::size_t(id) >= block_of_variable_.size() || block_of_variable_[std::size_t(id)] == kUnknown)
      throw Error("fixed-lag: " + problem_.name(id) + " was not in the last update, or that had no factor to give");
  }
}

Eigen::MatrixXd FixedLag::joint(const std::vector<int>& ids, const std::vector<int>& sizes) const {
  std::vector<int> blocks, rows;
  int n = 0;
  for (std::size_t k = 0; k < ids.size(); ++k) {
    const int block = block_of_variable_[std::size_t(ids[k])];
    if (block >= 0) blocks.push_back(block);
    for (int i = 0; i < sizes[k]; ++i, ++n)
      if (block >= 0) rows.push_back(n);
  }
  const Eigen::MatrixXd inverse = factor_->inverse_of(blocks);
  Eigen::MatrixXd S = Eigen::MatrixXd::Zero(n, n);
  S(rows, rows) = inverse;
  return S;
}

std::string why_unsupported(const Problem& problem, const FixedLagOptions&) {
  if (problem.num_hard_blocks() > 0)
    return "fixed-lag takes soft residuals only, and this problem has " + std::to_string(problem.num_hard_blocks()) +
           " hard ones: make them soft (minimize with a small sigma, or Outside for bounds)";
  return detail::why_unsolvable(problem);
}

}  // namespace tandem
