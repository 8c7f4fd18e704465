#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include <tandem/solvers/calibration/block_unknowns.hpp>
#include <tandem/solvers/calibration/log_constants.hpp>
#include <tandem/solvers/calibration/loss_terms.hpp>

namespace tandem::detail {
namespace {

constexpr double kPerturbation = 1e-4;  // for differences, relative to the information of a block
constexpr int kMaxConjugateSteps = 50;
constexpr double kTolerance = 1e-6;  // of the preconditioned residual, relative to its initial norm

}  // namespace

bool LossTerms::find(LaplaceApproximation& laplace) {
  blocks_.clear();
  terms_.clear();
  term_of_block_.clear();
  value_ = step_width_ = 0;
  nlp_ = &laplace.nlp();
  const Problem& problem = laplace.problem();
  for (const Block& block : laplace.student_t_blocks()) {
    add_block(laplace, block, true, expected_curvature(problem.loss(block)));
    const WhitenedBlock& by = blocks_.back();
    term_of_block_[{block.pool, block.id}] = terms_.size();
    terms_.push_back(tail_term(by.loss, by.r, 0.5 * (by.V + by.V.transpose())));
    value_ += terms_.back().value;
  }
  for (const auto& [block, measured] : laplace.weighted_blocks()) add_block(laplace, block, measured, 1);
  if (blocks_.empty()) return true;
  if (!differentiate_by_hessian(laplace)) return false;
  differentiate_by_solution(laplace);
  return true;
}

void LossTerms::add_block(const LaplaceApproximation& laplace, const Block& block, bool measured, double curvature) {
  const Problem& problem = laplace.problem();
  Problem::Linearization at = problem.linearization(block);
  const Eigen::MatrixXd W = problem.noise(block).sqrt_information();
  WhitenedBlock& by = blocks_.emplace_back(WhitenedBlock{problem.loss(block),
                                                         curvature,
                                                         W * at.residual,
                                                         W * at.jacobian,
                                                         std::move(at.variable_ids),
                                                         std::move(at.dofs),
                                                         {},
                                                         0});
  by.V = by.J * laplace.covariances().joint(by.variable_ids, by.dofs) * by.J.transpose();
  by.leverage = by.V.trace();
  if (!measured && laplace.has_prior_term())
    by.leverage -= laplace.prior_covariances().propagated(by.J, by.variable_ids, by.dofs).trace();
}

bool LossTerms::differentiate_by_hessian(LaplaceApproximation& laplace) {
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

/// Solves (H + T) v = h, where H + T is the Hessian of the cost and h the derivative by the solution, by conjugate
/// gradients with the preconditioner H. H + T is positive at a strict minimum, although losses are not convex. Products
/// H p follow from those of the residuals. With hard equalities, H⁻¹ is that of the confined Hessian.
void LossTerms::differentiate_by_solution(const LaplaceApproximation& laplace) {
  Eigen::VectorXd residual = Eigen::VectorXd::Zero(nlp_->num_unknowns());
  for (std::size_t i = 0; i < blocks_.size(); ++i) {
    const WhitenedBlock& b = blocks_[i];
    const double change = b.loss(b.r.squaredNorm()).d2;
    double by_weight = -0.5 * b.leverage;
    if (step_width_ != 0) by_weight += (b.J * hessian_derivative(b.variable_ids, b.dofs) * b.J.transpose()).trace();
    Eigen::VectorXd rows = 2 * by_weight * b.curvature * change * b.r;
    if (i < terms_.size()) rows += terms_[i].by_residual;
    add_gradient(b, rows, residual);
  }
  const auto covariances = laplace.covariances();
  by_solution_ = Eigen::VectorXd::Zero(residual.size());
  Eigen::VectorXd direction, H_direction;
  double last = 0, first = 0;
  for (int k = 0; k < kMaxConjugateSteps; ++k) {
    const Eigen::VectorXd preconditioned = covariances.times(residual);
    const double size = residual.dot(preconditioned);
    if (k == 0) first = size;
    if (!(size > kTolerance * kTolerance * first)) return;
    direction = k == 0 ? preconditioned : Eigen::VectorXd(preconditioned + size / last * direction);
    H_direction = k == 0 ? residual : Eigen::VectorXd(residual + size / last * H_direction);
    const Eigen::VectorXd product = H_direction + curvature_difference(direction);
    const double curvature = direction.dot(product);
    if (!(curvature > 0)) return;  // not a minimum
    by_solution_ += size / curvature * direction;
    residual -= size / curvature * product;
    last = size;
  }
}

/// Returns T step.
Eigen::VectorXd LossTerms::curvature_difference(const Eigen::VectorXd& step) const {
  Eigen::VectorXd product = Eigen::VectorXd::Zero(step.size());
  for (const WhitenedBlock& b : blocks_) {
    const auto [rho, weight, change] = b.loss(b.r.squaredNorm());
    const Eigen::VectorXd rows = b.J * block_part(*nlp_, b.variable_ids, b.dofs, b.J.cols(), step);
    add_gradient(b, (1 - b.curvature) * weight * rows + 2 * change * b.r.dot(rows) * b.r, product);
  }
  return product;
}

/// Adds (W J)ᵀ rows to `gradient`.
void LossTerms::add_gradient(const WhitenedBlock& by, const Eigen::VectorXd& rows, Eigen::VectorXd& gradient) const {
  add_block_part(*nlp_, by.variable_ids, by.dofs, by.J.transpose() * rows, gradient);
}

/// With W = W₀ D⁻¹ and D the diagonal of factors, ∂W/∂log D_j = −w_j eⱼᵀ, where w_j is column j of W. This changes W r,
/// W J Σ Jᵀ Wᵀ and the gradient Jᵀ ρ′ Wᵀ W r of the cost. The solution changes by the inverse of −(H + T) times the
/// change of the gradient.
Eigen::VectorXd LossTerms::noise_derivative(const LaplaceApproximation& laplace, const Block& block,
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

const TailTerm* LossTerms::of(const Block& block) const {
  const auto at = term_of_block_.find({block.pool, block.id});
  return at == term_of_block_.end() ? nullptr : &terms_[at->second];
}

Eigen::MatrixXd LossTerms::hessian_derivative(const std::vector<int>& variable_ids,
                                              const std::vector<int>& dofs) const {
  if (step_width_ == 0) {
    const int n = std::accumulate(dofs.begin(), dofs.end(), 0);
    return Eigen::MatrixXd::Zero(n, n);
  }
  const LaplaceApproximation::Covariances more{nlp_, inverse_plus_.get(), nullptr},
      less{nlp_, inverse_minus_.get(), nullptr};
  return (more.joint(variable_ids, dofs) - less.joint(variable_ids, dofs)) / step_width_;
}

}  // namespace tandem::detail
