#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include <tandem/solvers/calibration/block_unknowns.hpp>
#include <tandem/solvers/calibration/log_constants.hpp>
#include <tandem/solvers/calibration/tails.hpp>

namespace tandem::detail {
namespace {

constexpr double kTilt = 1e-4;  // of a block's information, for differences
constexpr int kMostRounds = 30;
constexpr double kNoMore = 1e-5;

}  // namespace

bool Tails::find(SettledProblem& settled) {
  blocks_.clear();
  terms_.clear();
  places_.clear();
  value_ = apart_ = 0;
  program_ = &settled.program();
  const Problem& problem = settled.problem();
  for (const Block& block : settled.student_t()) {
    Problem::Linearization at = problem.linearization(block);
    const Eigen::MatrixXd W = problem.noise(block).sqrt_information();
    const Whitened& by = blocks_.emplace_back(Whitened{problem.loss(block), W * at.residual, W * at.jacobian,
                                                       std::move(at.variable_ids), std::move(at.dofs)});
    const Eigen::MatrixXd V = by.J * settled.covariances().joint(by.variable_ids, by.dofs) * by.J.transpose();
    places_[{block.pool, block.id}] = terms_.size();
    terms_.push_back(tail_term(by.loss, by.r, 0.5 * (V + V.transpose())));
    value_ += terms_.back().value;
  }
  by_solution_ = Eigen::VectorXd::Zero(program_->num_unknowns());
  if (!find_by_hessian(settled)) return false;
  if (apart_ != 0) find_by_solution(settled);
  return true;
}

bool Tails::find_by_hessian(SettledProblem& settled) {
  double steepest = 0;
  for (std::size_t i = 0; i < terms_.size(); ++i)
    steepest = std::max(steepest, terms_[i].by_covariance.norm() / blocks_[i].loss(blocks_[i].r.squaredNorm()).d1);
  if (!(steepest > 0)) return true;  // nothing changes by it
  const double tilt = kTilt / steepest;
  const auto invert = [&](double by, std::unique_ptr<SelectedInverse>& inverse) {
    if (!inverse) inverse = std::make_unique<SelectedInverse>(program_->hessian_pattern());
    std::vector<Eigen::MatrixXd> tilts;
    for (const TailTerm& term : terms_) tilts.push_back(by * term.by_covariance);
    return settled.invert_tilted(tilts, *inverse);
  };
  if (!invert(tilt, more_) || !invert(-tilt, less_)) return false;
  apart_ = 2 * tilt;
  return true;
}

/// The solution moves by the inverse of the Hessian that there is, H + T, T what the one that is to be expected leaves out.
void Tails::find_by_solution(SettledProblem& settled) {
  Eigen::VectorXd h = by_solution_;
  for (std::size_t i = 0; i < terms_.size(); ++i) {
    const Whitened& b = blocks_[i];
    const Eigen::MatrixXd S = settled.covariances().joint(b.variable_ids, b.dofs);
    const double by_curvature = (b.J * (by_hessian(b.variable_ids, b.dofs) - 0.5 * S) * b.J.transpose()).trace();
    const double by_square = by_curvature * expected_curvature(b.loss) * b.loss(b.r.squaredNorm()).d2;
    pull(b, terms_[i].by_residual + 2 * by_square * b.r, h);
  }
  if (!settled.factorize(false)) return;
  double last = HUGE_VAL;
  for (int k = 0; k < kMostRounds; ++k) {
    Eigen::VectorXd next = h;
    for (const Whitened& b : blocks_) {
      const auto [rho, weight, change] = b.loss(b.r.squaredNorm());
      const Eigen::VectorXd by = moved(b, by_solution_);
      pull(b, (expected_curvature(b.loss) - 1) * weight * by - 2 * change * b.r.dot(by) * b.r, next);
    }
    settled.solve_factorized(next);
    const double step = (next - by_solution_).norm();
    if (!(step < last)) return;  // it does not come to rest: the Hessian that there is may have no inverse
    last = step;
    by_solution_ = next;
    if (step <= kNoMore * by_solution_.norm()) return;
  }
}

/// W J times the part of a step of all unknowns that is the block's.
Eigen::VectorXd Tails::moved(const Whitened& by, const Eigen::VectorXd& step) const {
  return by.J * of_block(*program_, by.variable_ids, by.dofs, by.J.cols(), step);
}

/// Adds (W J)ᵀ rows.
void Tails::pull(const Whitened& by, const Eigen::VectorXd& rows, Eigen::VectorXd& gradient) const {
  add_of_block(*program_, by.variable_ids, by.dofs, by.J.transpose() * rows, gradient);
}

/// With W = W₀ D⁻¹, D the factors, ∂W/∂log D_j = −w_j eⱼᵀ, w_j the column of W: so change W r, W J Σ Jᵀ Wᵀ, and the gradient
/// Jᵀ ρ′ Wᵀ W r of the cost, whose change the solution follows by −H⁻¹.
Eigen::VectorXd Tails::by_noise(const SettledProblem& settled, const Block& block,
                                const Problem::Linearization& at) const {
  const Problem& problem = settled.problem();
  const Eigen::MatrixXd W = problem.noise(block).sqrt_information(), information = W.transpose() * W;
  const Eigen::VectorXd& r = at.residual;
  const Eigen::VectorXd pulled = information * r, squares = pulled.cwiseProduct(r);
  const auto [rho, weight, change] = problem.loss(block)(squares.sum());
  const Eigen::VectorXd v =
      at.jacobian * of_block(*program_, at.variable_ids, at.dofs, at.jacobian.cols(), by_solution_);
  Eigen::VectorXd by =
      weight * ((information * v).cwiseProduct(r) + v.cwiseProduct(pulled)) + 2 * change * v.dot(pulled) * squares;
  if (const TailTerm* term = of(block)) {
    const Eigen::MatrixXd C =
        at.jacobian * settled.covariances().joint(at.variable_ids, at.dofs) * at.jacobian.transpose();
    by -= (W.transpose() * term->by_residual).cwiseProduct(r);
    by -= 2 * (W.transpose() * term->by_covariance * W).cwiseProduct(C).rowwise().sum();
  }
  return by;
}

const TailTerm* Tails::of(const Block& block) const {
  const auto at = places_.find({block.pool, block.id});
  return at == places_.end() ? nullptr : &terms_[at->second];
}

Eigen::MatrixXd Tails::by_hessian(const std::vector<int>& variable_ids, const std::vector<int>& dofs) const {
  if (apart_ == 0) {
    const int n = std::accumulate(dofs.begin(), dofs.end(), 0);
    return Eigen::MatrixXd::Zero(n, n);
  }
  const SettledProblem::Covariances more{program_, more_.get(), nullptr}, less{program_, less_.get(), nullptr};
  return (more.joint(variable_ids, dofs) - less.joint(variable_ids, dofs)) / apart_;
}

}  // namespace tandem::detail
