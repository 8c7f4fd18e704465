#include <cmath>
#include <numeric>

#include <Eigen/Cholesky>

#include <tandem/lie/error.hpp>
#include <tandem/solvers/calibration/default_solve.hpp>
#include <tandem/solvers/calibration/laplace_approximation.hpp>
#include <tandem/solvers/calibration/log_constants.hpp>
#include <tandem/solvers/linear/hessian_diagonal.hpp>

namespace tandem::detail {
namespace {

constexpr double kRegularization = 1e-9;           // relative to the diagonal of the Hessian
constexpr double kAbsoluteRegularization = 1e-12;  // for absolute_evidence: just above rounding
constexpr const char* kTask = "calibrate";
constexpr int kMaxSteps = 20, kMaxHalvings = 4;
// Converged if the predicted relative decrease of the cost is smaller: 1e-4 of a relevant change of the evidence.
constexpr double kConverged = 2e-9;
// Tolerance with Student's t, where the Hessian depends on the solution to first order.
constexpr double kConvergedWithTails = 1e-13;

}  // namespace

LaplaceApproximation::LaplaceApproximation(Problem& problem, const CalibrationOptions& options,
                                           std::vector<Block> measured)
    : problem_(problem),
      options_(options),
      measured_(std::move(measured)),
      by_steps_(!options.solve && problem.num_hard_blocks() == 0),
      nlp_(problem),
      cholesky_(pattern()),
      inverse_(pattern()),
      prior_inverse_(pattern()),
      gradient_(nlp_.num_unknowns()),
      prior_hessian_(static_cast<Eigen::Index>(measured_.empty() ? 0 : nlp_.hessian_pattern().nonzeros())),
      hessian_(nlp_.hessian_pattern().nonzeros()),
      step_(nlp_.num_unknowns()) {
  for (const Block& block : measured_)
    if (by_steps_ && problem.loss(block).kind == Loss::Kind::student_t) student_t_blocks_.push_back(block);
  if (!options.absolute_evidence) return;
  for (const Block& block : measured_) downweighted_.push_back(problem.noise(block).scaled(kAbsoluteDownweight));
  nlp_.linearize(gradient_, hessian_);
  set_regularization(kAbsoluteRegularization);
}

/// The pattern to be analysed. Checks for a stop first, because the analysis of many keyframes takes long.
const SymmetricPattern& LaplaceApproximation::pattern() const {
  options_.stop.check(kTask);
  return nlp_.hessian_pattern();
}

void LaplaceApproximation::save_values() { saved_values_.emplace(problem_); }

void LaplaceApproximation::restore_values() {
  if (!saved_values_) return;
  saved_values_->copy_to(problem_);
  near_solution_ = true;
  linearized_ = false;
}

bool LaplaceApproximation::update() {
  why_.clear();
  unobservable_.clear();
  linearized_ = false;
  const Summary summary = options_.solve ? options_.solve(problem_) : solve_with_default(problem_, options_.stop);
  if (!summary.converged()) options_.stop.check(kTask);
  cost_ = summary.cost;
  near_solution_ = summary.converged() && summary.unobservable.empty();
  if (!near_solution_) {
    unobservable_ = describe(summary.unobservable);
    why_ = summary.converged() ? "the problem is rank deficient; unobservable: " + unobservable_ : summary.message;
  }
  if (near_solution_ && !student_t_blocks_.empty()) update_by_steps();  // tighter than the solver's tolerance
  return near_solution_;
}

bool LaplaceApproximation::update_by_steps() {
  options_.stop.check(kTask);
  if (!by_steps_ || !near_solution_) return false;
  why_.clear();
  linearized_ = false;
  try {
    nlp_.reset();
    nlp_.save();
    double last = HUGE_VAL;  // predicted decrease of the previous step
    for (int k = 0; k < kMaxSteps; ++k) {
      options_.stop.check(kTask);
      cost_ = nlp_.linearize(gradient_, hessian_);
      if (!cholesky_.factorize(hessian_)) break;
      step_ = -gradient_;
      cholesky_.solve(step_);
      const double gain = -0.5 * gradient_.dot(step_);
      if (!(gain >= 0)) break;
      const bool converged = gain <= kConverged * (1 + cost_);
      if (converged && (student_t_blocks_.empty() || gain <= kConvergedWithTails * (1 + cost_) || gain > 0.5 * last))
        return linearized_ = true;  // or limited by rounding
      last = gain;
      nlp_.move_to(step_);
      for (int shorter = 0; !converged && !(nlp_.cost() < cost_); ++shorter) {
        if (shorter == kMaxHalvings) {
          nlp_.restore();
          return false;
        }
        step_ *= 0.5;
        nlp_.move_to(step_);
      }
      nlp_.recenter();
    }
    nlp_.restore();
  } catch (const Stopped&) {
    nlp_.restore();
    throw;
  } catch (const UndefinedResidualError&) {
    nlp_.restore();
  }
  return false;
}

/// Downweights the measurements during its lifetime.
class LaplaceApproximation::DownweightedMeasurements {
 public:
  explicit DownweightedMeasurements(LaplaceApproximation& laplace) : laplace_(laplace) {
    const bool whole = !laplace.downweighted_.empty();
    for (std::size_t i = 0; i < laplace.measured_.size(); ++i) {
      const Block& block = laplace.measured_[i];
      const Gaussian noise = laplace.problem_.noise(block);
      if (whole) noise_.push_back(noise);
      laplace.problem_.set_noise(block, whole ? laplace.downweighted_[i] : noise.scaled(kDownweight));
    }
  }
  ~DownweightedMeasurements() {
    for (std::size_t i = 0; i < laplace_.measured_.size(); ++i) {
      const Block& block = laplace_.measured_[i];
      laplace_.problem_.set_noise(block,
                                  noise_.empty() ? laplace_.problem_.noise(block).scaled(1 / kDownweight) : noise_[i]);
    }
  }
  DownweightedMeasurements(const DownweightedMeasurements&) = delete;

 private:
  LaplaceApproximation& laplace_;
  std::vector<Gaussian> noise_;
};

/// Replaces the losses of student_t_blocks_ by Gaussians of the expected curvature, plus a perturbation, during its
/// lifetime.
class LaplaceApproximation::ExpectedCurvature {
 public:
  explicit ExpectedCurvature(LaplaceApproximation& laplace, const std::vector<Eigen::MatrixXd>* perturbations = nullptr)
      : laplace_(laplace) {
    Problem& problem = laplace.problem_;
    for (const Block& block : laplace.student_t_blocks_) {
      saved_.emplace_back(problem.noise(block), problem.loss(block));
      const auto& [noise, loss] = saved_.back();
      const double weight = problem.weight(block) * expected_curvature(loss);
      if (perturbations) {
        Eigen::MatrixXd curvature = (*perturbations)[saved_.size() - 1];
        curvature.diagonal().array() += weight;
        const Eigen::MatrixXd root = curvature.llt().matrixU();
        problem.set_noise(block, Gaussian::square_root(root * noise.sqrt_information()));
      } else {
        problem.set_noise(block, noise.scaled(1 / std::sqrt(weight)));
      }
      problem.set_loss(block, {});
    }
  }
  ~ExpectedCurvature() {
    for (std::size_t i = saved_.size(); i-- > 0;) {
      laplace_.problem_.set_noise(laplace_.student_t_blocks_[i], saved_[i].first);
      laplace_.problem_.set_loss(laplace_.student_t_blocks_[i], saved_[i].second);
    }
  }
  ExpectedCurvature(const ExpectedCurvature&) = delete;

 private:
  LaplaceApproximation& laplace_;
  std::vector<std::pair<Gaussian, Loss>> saved_;
};

bool LaplaceApproximation::find_covariances() {
  marginals_.reset();
  prior_marginals_.reset();
  const auto check = [this] { options_.stop.check(kTask); };
  check();
  const bool beliefs = has_prior_term();
  bool found = false, found_prior = false;
  try {
    if (by_steps_) {
      linearize();
      const auto invert = [&](int which) {
        if (which == 0)
          found = inverse_.compute(hessian_, {}, check);
        else
          found_prior = prior_inverse_.compute(prior_hessian_, {}, check);
      };
      task_runner_.run(beliefs ? 2 : 1, invert);
    }
    // Marginals resolve weak pivots, or report which variable is unobservable.
    if (!found) marginals_.emplace(problem_, std::span<const Marginals::Pair>(), options_.stop).require_regular();
    if (beliefs && !found_prior) {
      const DownweightedMeasurements downweighted(*this);
      prior_marginals_.emplace(problem_, std::span<const Marginals::Pair>(), options_.stop).require_regular();
    }
    return true;
  } catch (const NotObservableError& error) {
    why_ = error.what();
    unobservable_ = error.states();
    return false;
  } catch (const NumericalError& error) {
    why_ = error.what();
    return false;
  }
}

/// Computes both Hessians at the solution.
void LaplaceApproximation::linearize() {
  if (!linearized_) {
    nlp_.reset();
    nlp_.linearize(gradient_, hessian_);
    linearized_ = true;
  }
  if (!student_t_blocks_.empty()) {
    const ExpectedCurvature curvature(*this);
    nlp_.linearize(step_, hessian_);
  }
  if (!has_prior_term()) return;
  const DownweightedMeasurements downweighted(*this);
  const double cost = nlp_.linearize(step_, prior_hessian_);
  regularize_prior_hessian();
  if (options_.absolute_evidence) compute_prior_step(cost);
}

void LaplaceApproximation::compute_prior_step(double cost) {
  prior_cost_ = 0;
  prior_step_.resize(0);
  if (!cholesky_.factorize(prior_hessian_)) return;
  prior_step_ = -step_;
  cholesky_.solve(prior_step_);
  prior_cost_ = cost + 0.5 * step_.dot(prior_step_);
}

bool LaplaceApproximation::invert_perturbed(const std::vector<Eigen::MatrixXd>& perturbations,
                                            SelectedInverse& inverse) {
  Eigen::VectorXd hessian(hessian_.size());
  {
    const ExpectedCurvature curvature(*this, &perturbations);
    nlp_.linearize(step_, hessian);
  }
  return inverse.compute(hessian, {}, [this] { options_.stop.check(kTask); });
}

bool LaplaceApproximation::factorize(bool prior) {
  return by_steps_ && cholesky_.factorize(prior ? prior_hessian_ : hessian_);
}

bool LaplaceApproximation::solve(Eigen::MatrixXd& columns, bool prior) {
  if (!factorize(prior)) return false;
  for (Eigen::Index i = 0; i < columns.cols(); ++i) {
    step_ = columns.col(i);
    cholesky_.solve(step_);
    columns.col(i) = step_;
  }
  return true;
}

void LaplaceApproximation::set_regularization(double share) {
  regularization_.resize(nlp_.hessian_pattern().size());
  hessian_diagonal(nlp_.hessian_pattern(), hessian_, regularization_);
  regularization_ *= share;
}

/// Bounds the directions that neither the prior nor the downweighted measurements determine numerically. The amount
/// does not depend on the noise factors.
void LaplaceApproximation::regularize_prior_hessian() {
  const SymmetricPattern& pattern = nlp_.hessian_pattern();
  if (regularization_.size() == 0) set_regularization(kRegularization);
  for (int k = 0; k < pattern.num_blocks(); ++k)
    for (int i = 0; i < pattern.width(k); ++i)
      prior_hessian_[pattern.diagonal(k, i)] += regularization_[pattern.first[std::size_t(k)] + i];
}

double LaplaceApproximation::Covariances::log_determinant() const {
  return marginals ? marginals->log_determinant() : inverse->log_determinant();
}

Eigen::MatrixXd LaplaceApproximation::Covariances::joint(const std::vector<int>& variable_ids,
                                                         const std::vector<int>& dofs) const {
  const int n = std::accumulate(dofs.begin(), dofs.end(), 0);
  if (marginals) return marginals->propagated(Eigen::MatrixXd::Identity(n, n), variable_ids, dofs);
  Eigen::MatrixXd S = Eigen::MatrixXd::Zero(n, n);  // stays zero for fixed variables
  for (std::size_t a = 0, row = 0; a < dofs.size(); row += std::size_t(dofs[a++]))
    for (std::size_t b = 0, column = 0; b <= a; column += std::size_t(dofs[b++])) {
      const int p = nlp->block_of(variable_ids[a]), q = nlp->block_of(variable_ids[b]);
      if (p < 0 || q < 0) continue;
      auto block = S.block(Eigen::Index(row), Eigen::Index(column), dofs[a], dofs[b]);
      inverse->block(p, q, block);
      if (a != b) S.block(Eigen::Index(column), Eigen::Index(row), dofs[b], dofs[a]) = block.transpose();
    }
  return S;
}

}  // namespace tandem::detail
