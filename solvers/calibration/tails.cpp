#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include <tandem/solvers/calibration/block_unknowns.hpp>
#include <tandem/solvers/calibration/log_constants.hpp>
#include <tandem/solvers/calibration/tails.hpp>

namespace tandem::detail {
namespace {

constexpr double kPerturbation = 1e-4;  // for differences, relative to the information of a block
constexpr int kMaxTailIterations = 30;
constexpr double kTolerance = 1e-5;

}  // namespace

bool Tails::find(LaplaceApproximation& laplace) {
  blocks_.clear();
  terms_.clear();
  term_of_block_.clear();
  value_ = step_width_ = 0;
  nlp_ = &laplace.nlp();
  const Problem& problem = laplace.problem();
  for (const Block& block : laplace.student_t_blocks()) {
    Problem::Linearization at = problem.linearization(block);
    const Eigen::MatrixXd W = problem.noise(block).sqrt_information();
    const WhitenedBlock& by = blocks_.emplace_back(WhitenedBlock{problem.loss(block), W * at.residual, W * at.jacobian,
                                                                 std::move(at.variable_ids), std::move(at.dofs)});
    const Eigen::MatrixXd V = by.J * laplace.covariances().joint(by.variable_ids, by.dofs) * by.J.transpose();
    term_of_block_[{block.pool, block.id}] = terms_.size();
    terms_.push_back(tail_term(by.loss, by.r, 0.5 * (V + V.transpose())));
    value_ += terms_.back().value;
  }
  by_solution_ = Eigen::VectorXd::Zero(nlp_->num_unknowns());
  if (!differentiate_by_hessian(laplace)) return false;
  if (step_width_ != 0) differentiate_by_solution(laplace);
  return true;
}

bool Tails::differentiate_by_hessian(LaplaceApproximation& laplace) {
  double steepest = 0;
  for (std::size_t i = 0; i < terms_.size(); ++i)
    steepest = std::max(steepest, terms_[i].by_covariance.norm() / blocks_[i].loss(blocks_[i].r.squaredNorm()).d1);
  if (!(steepest > 0)) return true;  // all derivatives are zero
  const double step = kPerturbation / steepest;
  const auto invert = [&](double by, std::unique_ptr<SelectedInverse>& inverse) {
    if (!inverse) inverse = std::make_unique<SelectedInverse>(nlp_->hessian_pattern());
    std::vector<Eigen::MatrixXd> perturbations;
    for (const TailTerm& term : terms_) perturbations.push_back(by * term.by_covariance);
    return laplace.invert_perturbed(perturbations, *inverse);
  };
  if (!invert(step, inverse_plus_) || !invert(-step, inverse_minus_)) return false;
  step_width_ = 2 * step;
  return true;
}

/// The solution moves by the inverse of the true Hessian H + T, where H has the expected curvature. Solves with H + T
/// by fixed-point iterations with the factorised H.
void Tails::differentiate_by_solution(LaplaceApproximation& laplace) {
  Eigen::VectorXd h = by_solution_;
  for (std::size_t i = 0; i < terms_.size(); ++i) {
    const WhitenedBlock& b = blocks_[i];
    const Eigen::MatrixXd S = laplace.covariances().joint(b.variable_ids, b.dofs);
    const double by_curvature =
        (b.J * (hessian_derivative(b.variable_ids, b.dofs) - 0.5 * S) * b.J.transpose()).trace();
    const double by_square = by_curvature * expected_curvature(b.loss) * b.loss(b.r.squaredNorm()).d2;
    add_gradient(b, terms_[i].by_residual + 2 * by_square * b.r, h);
  }
  if (!laplace.factorize(false)) return;
  double last = HUGE_VAL;
  for (int k = 0; k < kMaxTailIterations; ++k) {
    Eigen::VectorXd next = h;
    for (const WhitenedBlock& b : blocks_) {
      const auto [rho, weight, change] = b.loss(b.r.squaredNorm());
      const Eigen::VectorXd by = whitened_step(b, by_solution_);
      add_gradient(b, (expected_curvature(b.loss) - 1) * weight * by - 2 * change * b.r.dot(by) * b.r, next);
    }
    laplace.solve_factorized(next);
    const double step = (next - by_solution_).norm();
    if (!(step < last)) return;  // diverges: H + T may be singular
    last = step;
    by_solution_ = next;
    if (step <= kTolerance * by_solution_.norm()) return;
  }
}

/// Returns W J times the part of `step` that belongs to the block.
Eigen::VectorXd Tails::whitened_step(const WhitenedBlock& by, const Eigen::VectorXd& step) const {
  return by.J * block_part(*nlp_, by.variable_ids, by.dofs, by.J.cols(), step);
}

/// Adds (W J)ᵀ rows to `gradient`.
void Tails::add_gradient(const WhitenedBlock& by, const Eigen::VectorXd& rows, Eigen::VectorXd& gradient) const {
  add_block_part(*nlp_, by.variable_ids, by.dofs, by.J.transpose() * rows, gradient);
}

/// With W = W₀ D⁻¹ and D the diagonal of factors, ∂W/∂log D_j = −w_j eⱼᵀ, where w_j is column j of W. This changes W r,
/// W J Σ Jᵀ Wᵀ and the gradient Jᵀ ρ′ Wᵀ W r of the cost. The solution changes by −H⁻¹ times the change of the
/// gradient.
Eigen::VectorXd Tails::noise_derivative(const LaplaceApproximation& laplace, const Block& block,
                                        const Problem::Linearization& at) const {
  const Problem& problem = laplace.problem();
  const Eigen::MatrixXd W = problem.noise(block).sqrt_information(), information = W.transpose() * W;
  const Eigen::VectorXd& r = at.residual;
  const Eigen::VectorXd pulled = information * r, squares = pulled.cwiseProduct(r);
  const auto [rho, weight, change] = problem.loss(block)(squares.sum());
  const Eigen::VectorXd v = at.jacobian * block_part(*nlp_, at.variable_ids, at.dofs, at.jacobian.cols(), by_solution_);
  Eigen::VectorXd by =
      weight * ((information * v).cwiseProduct(r) + v.cwiseProduct(pulled)) + 2 * change * v.dot(pulled) * squares;
  if (const TailTerm* term = of(block)) {
    const Eigen::MatrixXd C =
        at.jacobian * laplace.covariances().joint(at.variable_ids, at.dofs) * at.jacobian.transpose();
    by -= (W.transpose() * term->by_residual).cwiseProduct(r);
    by -= 2 * (W.transpose() * term->by_covariance * W).cwiseProduct(C).rowwise().sum();
  }
  return by;
}

const TailTerm* Tails::of(const Block& block) const {
  const auto at = term_of_block_.find({block.pool, block.id});
  return at == term_of_block_.end() ? nullptr : &terms_[at->second];
}

Eigen::MatrixXd Tails::hessian_derivative(const std::vector<int>& variable_ids, const std::vector<int>& dofs) const {
  if (step_width_ == 0) {
    const int n = std::accumulate(dofs.begin(), dofs.end(), 0);
    return Eigen::MatrixXd::Zero(n, n);
  }
  const LaplaceApproximation::Covariances more{nlp_, inverse_plus_.get(), nullptr},
      less{nlp_, inverse_minus_.get(), nullptr};
  return (more.joint(variable_ids, dofs) - less.joint(variable_ids, dofs)) / step_width_;
}

}  // namespace tandem::detail
