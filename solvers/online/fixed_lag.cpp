#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <utility>

#include <Eigen/LU>

#include <tandem/problem/program.hpp>
#include <tandem/solvers/linear/hessian_diagonal.hpp>
#include <tandem/solvers/online/fixed_lag.hpp>
#include <tandem/solvers/online/warm_solve.hpp>
#include <tandem/solvers/session.hpp>

namespace tandem {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// Of the diagonal, for a direction that nothing observes, such as the heading of a target of which only positions are
/// measured: far above rounding, and a standard deviation of a million.
constexpr double kLeastInformation = 1e-12;
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
  if (!(options_.patience >= 0)) throw Error("fixed-lag: patience must not be negative");
  if (!(options_.cost_tolerance >= 0) || !(options_.step_tolerance >= 0) || !(options_.initial_damping >= 0))
    throw Error("fixed-lag: tolerances and initial_damping must not be negative");
}

double FixedLag::oldest() const {
  const auto first = std::find_if(timed_.begin(), timed_.end(), [&](const Timed& v) { return v.is_there(problem_); });
  return first == timed_.end() ? -kInfinity : first->t;
}

double FixedLag::newest() const {
  const auto last = std::find_if(timed_.rbegin(), timed_.rend(), [&](const Timed& v) { return v.is_there(problem_); });
  return last == timed_.rend() ? -kInfinity : last->t;
}

std::optional<std::string> FixedLag::why_too_late(double t) const {
  if (!slid_ || t >= oldest()) return {};
  return "t = " + seconds(t) + " is too late: the window has moved on and begins at " + seconds(oldest()) +
         " (to wait longer, widen it by FixedLagOptions::window or max_keyframes)";
}

void FixedLag::check_time(double t) const {
  if (!std::isfinite(t)) throw Error("fixed-lag: the time of a variable is not finite");
  if (const auto why = why_too_late(t)) throw Error("fixed-lag: " + *why);
}

void FixedLag::insert(Timed variable) {
  const int id = variable.id;
  const auto same = std::find_if(timed_.begin(), timed_.end(), [&](const Timed& v) { return v.id == id; });
  if (same != timed_.end() && same->is_there(problem_)) throw Error("fixed-lag: " + problem_.name(id) + " has a time");
  if (same != timed_.end()) timed_.erase(same);  // of one that has been removed
  const auto at =
      std::upper_bound(timed_.begin(), timed_.end(), variable.t, [](double a, const Timed& b) { return a < b.t; });
  timed_.insert(at, std::move(variable));
  forget(id);
}

/// The id is of no variable of the last update.
void FixedLag::forget(int id) {
  if (std::size_t(id) < block_of_variable_.size()) block_of_variable_[std::size_t(id)] = kUnknown;
  std::erase_if(extensions_, [&](const Extension& x) { return x.id == id; });
}

/// What has left the problem otherwise than by an update.
void FixedLag::drop_removed() {
  std::erase_if(timed_, [&](const Timed& v) {
    const bool removed = !v.is_there(problem_);
    if (removed) forget(v.id);
    return removed;
  });
}

Summary FixedLag::update() {
  gone_.clear();
  drop_removed();
  if (std::string why = why_unsupported(problem_, options_); !why.empty())
    return detail::refusal("fixed-lag", options_, std::move(why));
  Summary summary = solve_window();
  if (summary.status == Status::failed) return summary;
  const detail::Session::Timer timer(summary.seconds);
  marginalize_before(window_begin(summary.converged() ? 1.0 : 1.0 + options_.patience));
  return summary;
}

void FixedLag::expect_factor_of(const Program& program) {
  factor_.emplace(program.hessian_pattern());
  extensions_.clear();
  block_of_variable_.assign(std::size_t(problem_.id_bound()), kUnknown);
  for (int id = 0; id < problem_.id_bound(); ++id)
    if (!problem_.name(id).empty()) {
      const int block = program.block_of(id);
      block_of_variable_[std::size_t(id)] = block < 0 ? kFixed : block;
    }
}

bool FixedLag::relinearize() {
  Program program(problem_);
  expect_factor_of(program);
  Eigen::VectorXd gradient(program.num_unknowns()), shift(program.num_unknowns());
  Eigen::VectorXd hessian(static_cast<Eigen::Index>(program.hessian_pattern().row.size()));
  bool there = false;
  try {
    there = std::isfinite(program.linearize(gradient, hessian));
    detail::hessian_diagonal(program.hessian_pattern(), hessian, shift);
    shift *= kLeastInformation;
    there = there && factor_->factorize(hessian, shift);
  } catch (const Error&) {  // undefined there
  }
  if (!there) block_of_variable_.clear();
  return there;
}

Summary FixedLag::solve_window() {
  const auto begin = std::chrono::steady_clock::now();
  Program program(problem_);
  program.use_threads(options_.threads);
  expect_factor_of(program);
  detail::WarmSolve solve(program, *factor_, options_);
  Summary summary = solve.run();
  if (summary.status == Status::failed || solve.damped()) block_of_variable_.clear();  // no covariance
  summary.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return summary;
}

/// The time that the window, stretched so many times, reaches back to.
double FixedLag::window_begin(double stretch) const {
  double limit = newest() - stretch * options_.window;
  if (options_.max_keyframes > 0) {
    const double most = std::ceil(stretch * options_.max_keyframes);
    double begin = kInfinity;  // of the keyframe, from its latest time back
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

/// One time after the other: the dense systems stay small however much is old, and what has left is known to have left
/// when the next cannot.
void FixedLag::marginalize_before(double limit) {
  std::vector<int> ids;
  while (!timed_.empty()) {
    const double t = timed_.front().t;
    const auto later = [&](const Timed& v) { return v.t - t > kSameTime; };
    const auto end = std::find_if(timed_.begin(), timed_.end(), later);
    if (!(std::prev(end)->t < limit)) break;  // a keyframe goes as one
    if (options_.leaving) {
      options_.leaving(t);
      drop_removed();  // the caller may have taken some out
    }
    const auto first = timed_.begin(), last = std::find_if(first, timed_.end(), later);
    ids.clear();
    for (auto v = first; v != last; ++v) ids.push_back(v->id);
    problem_.marginalize(ids);
    slid_ = true;
    for (auto v = first; v != last; ++v) {
      gone_.push_back({v->t, v->id});
      forget(v->id);
    }
    timed_.erase(first, last);
  }
}

const FixedLag::Extension* FixedLag::extension_of(int id) const {
  const auto at = std::find_if(extensions_.begin(), extensions_.end(), [&](const Extension& x) { return x.id == id; });
  return at == extensions_.end() ? nullptr : &*at;
}

/// With the block's residual r = J_x δx + J δ + ε: x = −J_x⁻¹ (J δ + ε).
bool FixedLag::extend(const Block& block) {
  if (!has_covariance()) return false;
  const Problem::Linearization at = problem_.linearization(block);
  const auto block_of = [&](int id) {
    return std::size_t(id) < block_of_variable_.size() ? block_of_variable_[std::size_t(id)] : kUnknown;
  };
  Extension x{.id = -1, .blocks = {}, .dofs = {}, .by = {}, .noise = {}};
  Eigen::Index first = 0, dof = 0;
  for (std::size_t k = 0, row = 0; k < at.dofs.size(); row += std::size_t(at.dofs[k++])) {
    const int id = at.variable_ids[k];
    if (block_of(id) != kUnknown || extension_of(id)) continue;
    if (x.id >= 0) return false;
    x.id = id;
    first = Eigen::Index(row);
    dof = at.dofs[k];
  }
  if (x.id < 0 || at.residual.size() != dof) return false;
  const Eigen::FullPivLU<Eigen::MatrixXd> own(-at.jacobian.middleCols(first, dof));
  if (!own.isInvertible()) return false;
  const Eigen::MatrixXd inverse = own.inverse();
  x.noise = inverse * problem_.noise(block).covariance_matrix() * inverse.transpose();
  x.by.resize(dof, 0);
  const auto append = [&](int of_block, int columns, const Eigen::MatrixXd& by) {
    x.blocks.push_back(of_block);
    x.dofs.push_back(columns);
    x.by.conservativeResize(Eigen::NoChange, x.by.cols() + columns);
    x.by.rightCols(columns) = by;
  };
  for (std::size_t k = 0, row = 0; k < at.dofs.size(); row += std::size_t(at.dofs[k++])) {
    const int id = at.variable_ids[k];
    if (id == x.id || block_of(id) == kFixed) continue;
    const Eigen::MatrixXd by = inverse * at.jacobian.middleCols(Eigen::Index(row), at.dofs[k]);
    if (const Extension* from = extension_of(id)) {
      x.noise += by * from->noise * by.transpose();
      for (std::size_t i = 0, column = 0; i < from->dofs.size(); column += std::size_t(from->dofs[i++]))
        append(from->blocks[i], from->dofs[i], by * from->by.middleCols(Eigen::Index(column), from->dofs[i]));
    } else {
      append(block_of(id), at.dofs[k], by);
    }
  }
  extensions_.push_back(std::move(x));
  return true;
}

void FixedLag::check_known(const std::vector<int>& ids) const {
  bool extended = false;
  for (const int id : ids) {
    if (extension_of(id)) {
      if (std::exchange(extended, true))
        throw Error("fixed-lag: one of two variables at a time that were added since the last update");
      continue;
    }
    if (id < 0) throw Error("fixed-lag: covariance of a variable that is not in the problem (any more)");
    const bool reused =
        std::any_of(timed_.begin(), timed_.end(), [&](const Timed& v) { return v.id == id && !v.is_there(problem_); });
    if (reused || std::size_t(id) >= block_of_variable_.size() || block_of_variable_[std::size_t(id)] == kUnknown)
      throw Error("fixed-lag: " + problem_.name(id) + " was not in the last update, or that had no factor to give");
  }
}

Eigen::MatrixXd FixedLag::joint(const std::vector<int>& ids, const std::vector<int>& sizes) const {
  std::vector<int> blocks, widths, rows;  // of the factor, their unknowns, and where each of these goes
  const Extension* extension = nullptr;
  Eigen::Index extended_at = 0;
  int n = 0;
  for (std::size_t k = 0; k < ids.size(); n += sizes[k++]) {
    if (const Extension* x = extension_of(ids[k])) {
      extension = x;
      extended_at = n;
      continue;
    }
    const int block = block_of_variable_[std::size_t(ids[k])];
    if (block < 0) continue;
    blocks.push_back(block);
    widths.push_back(sizes[k]);
    for (int i = 0; i < sizes[k]; ++i) rows.push_back(n + i);
  }
  Eigen::MatrixXd S = Eigen::MatrixXd::Zero(n, n);
  if (!extension) {
    S(rows, rows) = factor_->inverse_of(blocks);
    return S;
  }
  const Eigen::Index known = Eigen::Index(rows.size());
  Eigen::MatrixXd by = Eigen::MatrixXd::Zero(n, known);  // what is asked for, of the factor's unknowns
  for (Eigen::Index i = 0; i < known; ++i) by(rows[std::size_t(i)], i) = 1.0;
  for (std::size_t i = 0, column = 0; i < extension->dofs.size(); column += std::size_t(extension->dofs[i++])) {
    const int block = extension->blocks[i], dof = extension->dofs[i];
    Eigen::Index at = 0;
    std::size_t k = 0;
    for (; k < blocks.size() && blocks[k] != block; ++k) at += widths[k];
    if (k == blocks.size()) {
      blocks.push_back(block);
      widths.push_back(dof);
      by.conservativeResize(Eigen::NoChange, by.cols() + dof);
      by.rightCols(dof).setZero();
    }
    by.block(extended_at, at, extension->by.rows(), dof) += extension->by.middleCols(Eigen::Index(column), dof);
  }
  S.noalias() = by * factor_->inverse_of(blocks) * by.transpose();
  S.block(extended_at, extended_at, extension->noise.rows(), extension->noise.rows()) += extension->noise;
  return S;
}

std::string why_unsupported(const Problem& problem, const FixedLagOptions&) {
  if (problem.num_hard_blocks() > 0)
    return "fixed-lag takes soft residuals only, and this problem has " + std::to_string(problem.num_hard_blocks()) +
           " hard ones: make them soft (minimize with a small sigma, or Outside for bounds)";
  return detail::why_unsolvable(problem);
}

}  // namespace tandem
