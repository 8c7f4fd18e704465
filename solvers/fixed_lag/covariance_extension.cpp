#include <algorithm>
#include <iterator>
#include <numeric>
#include <utility>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>

#include <tandem/lie/error.hpp>
#include <tandem/solvers/fixed_lag/covariance_extension.hpp>

namespace tandem::detail {
namespace {

bool contains(const std::vector<int>& ids, int id) { return std::find(ids.begin(), ids.end(), id) != ids.end(); }

/// Maximum ratio of the terms of a variance to their sum. Values have moved since the linearisation; this leaves an
/// error of the ratio times the squared relative change.
constexpr double kMaxCancellation = 1e4;
constexpr double kMaxVarianceReduction =
    1e10;                           // maximum reduction of a variance by an update; above it, rounding dominates
constexpr double kKnownRow = 1e-9;  // smaller variances of an exact row, relative to the largest one, are rounding

/// Returns the Jacobian of a block with respect to these variables, side by side; 0 for fixed ones.
Eigen::MatrixXd jacobian_of(const Problem& problem, const Problem::Linearization& at, const std::vector<int>& ids,
                            const std::vector<int>& dofs) {
  Eigen::MatrixXd J = Eigen::MatrixXd::Zero(at.residual.size(), std::accumulate(dofs.begin(), dofs.end(), 0));
  for (std::size_t i = 0, to = 0; i < ids.size(); to += std::size_t(dofs[i++])) {
    if (problem.is_fixed(ids[i])) continue;
    for (std::size_t k = 0, from = 0; k < at.dofs.size(); from += std::size_t(at.dofs[k++]))
      if (at.variable_ids[k] == ids[i])
        J.middleCols(Eigen::Index(to), dofs[i]) += at.jacobian.middleCols(Eigen::Index(from), dofs[i]);
  }
  return J;
}

/// Conditions a covariance on rows with the cross-covariance `cross` and the covariance `own`, without noise. Rows that
/// depend on others, or are known already, change nothing.
void condition_on(const Eigen::MatrixXd& cross, const Eigen::MatrixXd& own, Eigen::Ref<Eigen::MatrixXd> P) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(own);
  const double least = kKnownRow * eigen.eigenvalues().cwiseAbs().maxCoeff();
  for (Eigen::Index i = 0; i < own.rows(); ++i) {
    if (!(eigen.eigenvalues()[i] > least)) continue;
    const Eigen::VectorXd column = cross.transpose() * eigen.eigenvectors().col(i);
    P -= column * column.transpose() / eigen.eigenvalues()[i];
  }
}

}  // namespace

void CovarianceExtension::Joint::append(int id, int dof) {
  if (contains(ids, id)) return;
  ids.push_back(id);
  dofs.push_back(dof);
  at.push_back(size);
  size += dof;
}

int CovarianceExtension::Joint::of(int id) const {
  return at[std::size_t(std::find(ids.begin(), ids.end(), id) - ids.begin())];
}

void CovarianceExtension::clear() {
  added_.clear();
  steps_.clear();
  extended_ = {};
}

bool CovarianceExtension::has(int id) const { return contains(added_, id); }

bool CovarianceExtension::extend(const Problem& problem, const std::vector<int>& added, const Known& known) {
  if (added.empty()) return true;
  std::optional<std::vector<Step>> steps;
  try {
    steps = steps_to(problem, added);
  } catch (const UndefinedResidualError&) {  // a residual is undefined
  }
  if (!steps) return false;
  const std::size_t steps_before = steps_.size(), added_before = added_.size();
  std::move(steps->begin(), steps->end(), std::back_inserter(steps_));
  added_.insert(added_.end(), added.begin(), added.end());
  Joint near = propagate({}, known);
  if (near.covariance.size() > 0) {
    extended_ = std::move(near);
    return true;
  }
  steps_.resize(steps_before);
  added_.resize(added_before);
  return false;
}

std::optional<std::vector<CovarianceExtension::Step>> CovarianceExtension::steps_to(
    const Problem& problem, const std::vector<int>& added) const {
  std::vector<Step> steps;
  std::vector<Block> blocks = problem.soft_blocks_reading(added);
  const std::vector<Block> hard = problem.hard_blocks_reading(added);
  std::vector<int> missing = added;
  // A block with as many rows as missing unknowns determines them. Later blocks are measurements of known variables.
  const auto use_block = [&](const Block& block) {
    const Problem::Linearization at = problem.linearization(block);
    Step step;
    for (std::size_t k = 0; k < at.dofs.size(); ++k) {
      const int id = at.variable_ids[k];
      if (contains(step.added, id) || contains(step.others, id)) continue;  // a block may read a variable twice
      const bool is_missing = contains(missing, id);
      (is_missing ? step.added : step.others).push_back(id);
      (is_missing ? step.added_dofs : step.other_dofs).push_back(at.dofs[k]);
    }
    step.transition = jacobian_of(problem, at, step.others, step.other_dofs);
    step.noise = problem.noise(block).covariance_matrix();
    if (!step.added.empty()) {
      const Eigen::MatrixXd own = jacobian_of(problem, at, step.added, step.added_dofs);
      if (own.rows() != own.cols()) return false;
      const Eigen::FullPivLU<Eigen::MatrixXd> lu(-own);
      if (!lu.isInvertible()) return false;
      const Eigen::MatrixXd inverse = lu.inverse();
      step.transition = inverse * step.transition;
      step.noise = inverse * step.noise * inverse.transpose();
      std::erase_if(missing, [&](int id) { return contains(step.added, id); });
    }
    steps.push_back(std::move(step));
    return true;
  };
  while (std::erase_if(blocks, use_block) > 0) {
  }
  if (!blocks.empty() || !missing.empty()) return {};
  // Equalities are measurements without noise. Which inequalities are active is known after the next solve.
  for (const Block& block : hard) {
    const Bounds<Eigen::Dynamic> bounds = problem.bounds(block);
    const Problem::Linearization at = problem.linearization(block);
    Step step;
    step.exact = true;
    std::vector<Eigen::Index> rows;
    for (Eigen::Index i = 0; i < bounds.lower.size(); ++i)
      if (bounds.lower[i] == bounds.upper[i]) rows.push_back(i);
    if (rows.empty()) continue;
    for (std::size_t k = 0; k < at.dofs.size(); ++k) {
      const int id = at.variable_ids[k];
      if (contains(step.others, id)) continue;
      step.others.push_back(id);
      step.other_dofs.push_back(at.dofs[k]);
    }
    const Eigen::MatrixXd by_others = jacobian_of(problem, at, step.others, step.other_dofs);
    step.transition = by_others(rows, Eigen::seqN(0, by_others.cols()));
    step.noise = Eigen::MatrixXd::Zero(Eigen::Index(rows.size()), Eigen::Index(rows.size()));
    steps.push_back(std::move(step));
  }
  return steps;
}

/// Returns an empty covariance if unobservable directions dominate it.
CovarianceExtension::Joint CovarianceExtension::propagate(Joint joint, const Known& known) const {
  for (const Step& step : steps_)
    for (std::size_t k = 0; k < step.others.size(); ++k)
      if (!has(step.others[k])) joint.append(step.others[k], step.other_dofs[k]);
  int n = joint.size;  // dimension of the variables so far
  const Eigen::MatrixXd before = known(joint.ids, joint.dofs);
  for (const Step& step : steps_)
    for (std::size_t k = 0; k < step.added.size(); ++k) joint.append(step.added[k], step.added_dofs[k]);

  Eigen::MatrixXd& P = joint.covariance;
  P.setZero(joint.size, joint.size);
  P.topLeftCorner(n, n) = before;
  for (const Step& step : steps_) {
    Eigen::MatrixXd transition = Eigen::MatrixXd::Zero(step.transition.rows(), n);
    for (std::size_t k = 0, from = 0; k < step.others.size(); from += std::size_t(step.other_dofs[k++]))
      transition.middleCols(joint.of(step.others[k]), step.other_dofs[k]) =
          step.transition.middleCols(Eigen::Index(from), step.other_dofs[k]);
    const Eigen::MatrixXd cross = transition * P.topLeftCorner(n, n);
    const Eigen::MatrixXd own = cross * transition.transpose() + step.noise;
    if (step.exact) {
      condition_on(cross, own, P.topLeftCorner(n, n));
      continue;
    }
    if (step.added.empty()) {
      const Eigen::VectorXd least = P.diagonal().head(n) / kMaxVarianceReduction;
      P.topLeftCorner(n, n) -= cross.transpose() * own.ldlt().solve(cross);
      if (!(P.diagonal().head(n).array() >= least.array()).all()) return {};
      continue;
    }
    const Eigen::VectorXd terms = transition.cwiseAbs2() * P.diagonal().head(n);
    if (!(terms.array() <= kMaxCancellation * own.diagonal().array()).all()) return {};
    const auto m = static_cast<int>(own.rows());
    P.block(n, 0, m, n) = cross;
    P.block(0, n, n, m) = cross.transpose();
    P.block(n, n, m, m) = own;
    n += m;
  }
  return joint;
}

Eigen::MatrixXd CovarianceExtension::joint(const std::vector<int>& ids, const std::vector<int>& dofs,
                                           const Known& known) const {
  Joint wider;
  const bool is_extended = std::all_of(ids.begin(), ids.end(), [&](int id) { return contains(extended_.ids, id); });
  if (!is_extended) {
    for (std::size_t k = 0; k < ids.size(); ++k)
      if (!has(ids[k])) wider.append(ids[k], dofs[k]);
    wider = propagate(std::move(wider), known);
    if (wider.covariance.size() == 0)
      throw NumericalError("fixed-lag: no covariance, because rounding dominates in an unobservable direction");
  }
  const Joint& all = is_extended ? extended_ : wider;
  std::vector<int> rows;
  for (std::size_t k = 0; k < ids.size(); ++k)
    for (int i = 0; i < dofs[k]; ++i) rows.push_back(all.of(ids[k]) + i);
  return all.covariance(rows, rows);
}

}  // namespace tandem::detail
