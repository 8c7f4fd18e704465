#include <cmath>
#include <set>

#include <Eigen/Cholesky>

#include <tandem/lie/error.hpp>
#include <tandem/problem/all_blocks.hpp>
#include <tandem/solvers/calibration/default_solve.hpp>
#include <tandem/solvers/calibration/laplace_approximation.hpp>
#include <tandem/solvers/calibration/log_constants.hpp>

namespace tandem::detail {
namespace {

constexpr double kRounding = 1e-16;      // relative error of an entry of a Hessian
constexpr double kMaxPriorError = 1e-5;  // accepted bound of the error of the log determinant by rounding
// Factors on the given noise of the measurements while the integral of the priors is computed. The first leaves 1e-6 of
// their information. The second, for CalibrationOptions::absolute_evidence, leaves 1e-16. The noise is the given one, so
// that the integral does not depend on the noise factors of the measurements.
constexpr double kDownweight = 1e3, kAbsoluteDownweight = 1e8;
constexpr const char* kTask = "calibrate";
constexpr int kMaxSteps = 30, kMaxHalvings = 4;
constexpr double kMaxRate = 0.95;  // of the convergence with robust losses
// Converged if the predicted relative decrease of the cost is smaller: 1e-4 of a relevant change of the evidence.
constexpr double kConverged = 2e-9;
// With robust losses, where the Hessian depends on the solution to first order.
constexpr double kConvergedWithLosses = 1e-13;

/// Returns the soft blocks with a robust loss.
std::vector<Block> blocks_with_loss(const Problem& problem) {
  std::vector<Block> blocks = soft_blocks(problem);
  std::erase_if(blocks, [&](const Block& block) { return problem.loss(block).kind == Loss::Kind::none; });
  return blocks;
}

/// Returns the columns of J of the variables that are not fixed, and appends their blocks in the pattern.
Eigen::MatrixXd free_columns(const NlpEvaluator& nlp, const Eigen::MatrixXd& J, const std::vector<int>& variable_ids,
                             const std::vector<int>& dofs, std::vector<int>& blocks) {
  Eigen::MatrixXd used(J.rows(), J.cols());
  Eigen::Index column = 0, n = 0;
  for (std::size_t v = 0; v < dofs.size(); column += dofs[v++]) {
    const int k = nlp.block_of(variable_ids[v]);
    if (k < 0) continue;
    blocks.push_back(k);
    used.middleCols(n, dofs[v]) = J.middleCols(column, dofs[v]);
    n += dofs[v];
  }
  return used.leftCols(n);
}

}  // namespace

LaplaceApproximation::LaplaceApproximation(Problem& problem, const CalibrationOptions& options,
                                           std::vector<Block> measured)
    : problem_(problem),
      saved_values_(problem),
      options_(options),
      measured_(std::move(measured)),
      by_steps_(!options.solve && problem.num_hard_blocks() == 0),
      nlp_(problem),
      cholesky_(pattern()),
      inverse_(pattern()),
      prior_inverse_(pattern()),
      gradient_(nlp_.num_unknowns()),
      prior_gradient_(nlp_.num_unknowns()),
      prior_hessian_(static_cast<Eigen::Index>(measured_.empty() ? 0 : nlp_.hessian_pattern().nonzeros())),
      hessian_(nlp_.hessian_pattern().nonzeros()),
      step_(nlp_.num_unknowns()) {
  const double downweight = options.absolute_evidence ? kAbsoluteDownweight : kDownweight;
  for (const Block& block : measured_) downweighted_.push_back(problem.noise(block).scaled(downweight));
  std::set<std::pair<int, int>> is_measured;
  for (const Block& block : measured_) is_measured.emplace(block.pool, block.id);
  for (const Block& block : blocks_with_loss(problem)) {
    const bool of_measurement = is_measured.contains({block.pool, block.id});
    if (of_measurement && by_steps_ && problem.loss(block).kind == Loss::Kind::student_t)
      student_t_blocks_.push_back(block);
    else
      weighted_blocks_.emplace_back(block, of_measurement);
  }
}

/// The pattern to be analysed. Checks for a stop first, because the analysis of many keyframes takes long.
const SymmetricPattern& LaplaceApproximation::pattern() const {
  options_.stop.check(kTask);
  return nlp_.hessian_pattern();
}

void LaplaceApproximation::save_values() { saved_values_ = SavedValues(problem_); }

void LaplaceApproximation::restore_values() {
  saved_values_.copy_to(problem_);
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
  if (near_solution_ && has_losses()) update_by_steps();  // tighter than the solver's tolerance
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
    bool lengthened = true;  // the previous step is not a plain one
    for (int k = 0; k < kMaxSteps; ++k) {
      options_.stop.check(kTask);
      cost_ = nlp_.linearize(gradient_, hessian_);
      if (!cholesky_.factorize(hessian_)) break;
      step_ = -gradient_;
      cholesky_.solve(step_);
      const double gain = -0.5 * gradient_.dot(step_);
      if (!(gain >= 0)) break;
      if (gain <= (has_losses() ? kConvergedWithLosses : kConverged) * (1 + cost_)) return linearized_ = true;
      const bool converged = gain <= kConverged * (1 + cost_);
      // Robust losses make steps too short by a constant factor, which the decrease of the gain reveals.
      lengthened = has_losses() && !lengthened && gain < last;
      if (lengthened) step_ /= 1 - std::min(std::sqrt(gain / last), kMaxRate);
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
    if (last <= kConverged * (1 + cost_)) return true;  // slow convergence with a robust loss
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
    for (const Block& block : laplace.measured_) noise_.push_back(laplace.problem_.noise(block));
    set(laplace.downweighted_);
  }
  ~DownweightedMeasurements() { set(noise_); }
  DownweightedMeasurements(const DownweightedMeasurements&) = delete;

 private:
  void set(const std::vector<Gaussian>& noise) {
    for (std::size_t i = 0; i < noise.size(); ++i) laplace_.problem_.set_noise(laplace_.measured_[i], noise[i]);
  }

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
  prior_cost_ = 0;
  prior_step_.resize(0);
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
          found_prior = invert_prior();
      };
      task_runner_.run(beliefs ? 2 : 1, invert);
      if (found_prior) find_prior_minimum();
    }
    // Marginals resolve weak pivots, or report which variable is unobservable.
    if (!found) (marginals_ = Marginals::without_gauges(problem_, options_.stop))->require_regular();
    if (beliefs && !found_prior) {
      const DownweightedMeasurements downweighted(*this);
      (prior_marginals_ = Marginals::without_gauges(problem_, options_.stop))->require_regular();
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
    cost_ = nlp_.linearize(gradient_, hessian_);
    linearized_ = true;
  }
  if (!student_t_blocks_.empty()) {
    const ExpectedCurvature curvature(*this);
    nlp_.linearize(step_, hessian_);
  }
  if (!has_prior_term()) return;
  const DownweightedMeasurements downweighted(*this);
  cost_of_priors_ = prior_by_rows_ ? nlp_.cost() : nlp_.linearize(prior_gradient_, prior_hessian_);
}

/// Inverts the Hessian of the priors. Without measurements, a chain has a condition number that grows with the fourth
/// power of its length, so that the Hessian may not even be numerically positive. If rounding affects the result, uses
/// the rows instead, from then on.
bool LaplaceApproximation::invert_prior() {
  const auto check = [this] { options_.stop.check(kTask); };
  if (!prior_by_rows_) {
    const bool found = prior_inverse_.compute(prior_hessian_, {}, check);
    if (found && kRounding * prior_inverse_.trace_of_product() <= kMaxPriorError) return true;
    prior_by_rows_ = true;
  }
  return prior_inverse_.compute_from_rows(prior_rows(), check);
}

void LaplaceApproximation::find_prior_minimum() {
  if (!options_.absolute_evidence) return;
  prior_step_ = prior_by_rows_ ? prior_inverse_.minimizer() : Eigen::VectorXd(-prior_inverse_.times(prior_gradient_));
  prior_cost_ =
      cost_of_priors_ - (prior_by_rows_ ? prior_inverse_.decrease() : -0.5 * prior_gradient_.dot(prior_step_));
}

/// Returns the rows of all soft blocks, including the marginal prior, with downweighted measurements.
std::vector<WhitenedRows> LaplaceApproximation::prior_rows() {
  const DownweightedMeasurements downweighted(*this);
  std::vector<WhitenedRows> all;
  for (const Block& block : problem_.blocks()) {
    const Problem::Linearization at = problem_.linearization(block);
    const Eigen::MatrixXd W = std::sqrt(problem_.weight(block)) * problem_.noise(block).sqrt_information();
    WhitenedRows& rows = all.emplace_back();
    rows.r = W * at.residual;
    rows.J = free_columns(nlp_, W * at.jacobian, at.variable_ids, at.dofs, rows.blocks);
  }
  return all;
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

double LaplaceApproximation::Covariances::log_determinant() const {
  return marginals ? marginals->log_determinant() : inverse->log_determinant();
}

Eigen::MatrixXd LaplaceApproximation::Covariances::propagated(const Eigen::MatrixXd& J,
                                                              const std::vector<int>& variable_ids,
                                                              const std::vector<int>& dofs) const {
  if (marginals) return marginals->propagated(J, variable_ids, dofs);
  std::vector<int> blocks;
  const Eigen::MatrixXd used = free_columns(*nlp, J, variable_ids, dofs, blocks);
  return inverse->propagated(blocks, used);
}

Eigen::VectorXd LaplaceApproximation::Covariances::times(const Eigen::VectorXd& x) const {
  return marginals ? marginals->times(x) : inverse->times(x);
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
