#include <cmath>
#include <numeric>

#include <Eigen/Cholesky>

#include <tandem/lie/error.hpp>
#include <tandem/solvers/calibration/calibrate_built.hpp>
#include <tandem/solvers/calibration/log_constants.hpp>
#include <tandem/solvers/calibration/settled_problem.hpp>
#include <tandem/solvers/calibration/solve_plainly.hpp>
#include <tandem/solvers/linear/hessian_diagonal.hpp>

namespace tandem::detail {
namespace {

constexpr double kHold = 1e-9;        // of the Hessian's diagonal
constexpr double kHoldWhole = 1e-12;  // of that by the noise as given: above rounding, and no more
constexpr const char* kWhat = "calibrate";
constexpr int kMostSteps = 20, kShorter = 4;
constexpr double kAtRest = 2e-9;          // of the cost, that a step would still gain: 1e-4 of what evidence is told by
constexpr double kAtRestByTails = 1e-13;  // where the Hessian depends on the solution, to first order

}  // namespace

SettledProblem::SettledProblem(Problem& problem, const CalibrationOptions& options, std::vector<Block> measured)
    : problem_(problem),
      options_(options),
      measured_(std::move(measured)),
      by_steps_(!options.solve && problem.num_hard_blocks() == 0),
      program_(problem),
      cholesky_(pattern()),
      inverse_(pattern()),
      beliefs_inverse_(pattern()),
      gradient_(program_.num_unknowns()),
      beliefs_hessian_(static_cast<Eigen::Index>(measured_.empty() ? 0 : program_.hessian_pattern().nonzeros())),
      hessian_(program_.hessian_pattern().nonzeros()),
      step_(program_.num_unknowns()) {
  for (const Block& block : measured_)
    if (by_steps_ && problem.loss(block).kind == Loss::Kind::student_t) student_t_.push_back(block);
  if (!options.whole_integral) return;
  for (const Block& block : measured_) faint_.push_back(problem.noise(block).scaled(kFaintWhole));
  program_.linearize(gradient_, hessian_);
  take_hold(kHoldWhole);
}

/// To be analysed, which takes long where there are many keyframes.
const SymmetricPattern& SettledProblem::pattern() const {
  options_.stop.check(kWhat);
  return program_.hessian_pattern();
}

void SettledProblem::keep_place() {
  if (place_)
    take_values(problem_, *place_);
  else
    place_.emplace(problem_.copy());
}

void SettledProblem::go_back() {
  if (!place_) return;
  take_values(*place_, problem_);
  near_ = true;
  linearized_ = false;
}

bool SettledProblem::settle() {
  why_.clear();
  linearized_ = false;
  const Summary summary = options_.solve ? options_.solve(problem_) : solve_plainly(problem_, options_.stop);
  if (!summary.converged()) options_.stop.check(kWhat);
  cost_ = summary.cost;
  near_ = summary.converged();
  if (!near_) why_ = summary.message;
  if (near_ && !student_t_.empty()) settle_by_steps();  // nearer than a whole solve ends
  return near_;
}

bool SettledProblem::settle_by_steps() {
  options_.stop.check(kWhat);
  if (!by_steps_ || !near_) return false;
  why_.clear();
  linearized_ = false;
  try {
    program_.reset();
    program_.keep();
    double last = HUGE_VAL;  // what the step before would gain
    for (int k = 0; k < kMostSteps; ++k) {
      options_.stop.check(kWhat);
      cost_ = program_.linearize(gradient_, hessian_);
      if (!cholesky_.factorize(hessian_)) break;
      step_ = -gradient_;
      cholesky_.solve(step_);
      const double gain = -0.5 * gradient_.dot(step_);
      if (!(gain >= 0)) break;
      const bool at_rest = gain <= kAtRest * (1 + cost_);
      if (at_rest && (student_t_.empty() || gain <= kAtRestByTails * (1 + cost_) || gain > 0.5 * last))
        return linearized_ = true;  // or as near as rounding lets it come
      last = gain;
      program_.move_to(step_);
      for (int shorter = 0; !at_rest && !(program_.cost() < cost_); ++shorter) {
        if (shorter == kShorter) {
          program_.restore();
          return false;
        }
        step_ *= 0.5;
        program_.move_to(step_);
      }
      program_.recenter();
    }
    program_.restore();
  } catch (const Stopped&) {
    program_.restore();
    throw;
  } catch (const Error&) {  // a residual is undefined on the way
    program_.restore();
  }
  return false;
}

/// What is measured counts next to nothing while it lives.
class SettledProblem::Faint {
 public:
  explicit Faint(SettledProblem& settled) : settled_(settled) {
    const bool whole = !settled.faint_.empty();
    for (std::size_t i = 0; i < settled.measured_.size(); ++i) {
      const Block& block = settled.measured_[i];
      const Gaussian noise = settled.problem_.noise(block);
      if (whole) noise_.push_back(noise);
      settled.problem_.set_noise(block, whole ? settled.faint_[i] : noise.scaled(kFaint));
    }
  }
  ~Faint() {
    for (std::size_t i = 0; i < settled_.measured_.size(); ++i) {
      const Block& block = settled_.measured_[i];
      settled_.problem_.set_noise(block,
                                  noise_.empty() ? settled_.problem_.noise(block).scaled(1 / kFaint) : noise_[i]);
    }
  }
  Faint(const Faint&) = delete;

 private:
  SettledProblem& settled_;
  std::vector<Gaussian> noise_;
};

/// Blocks under Student's t have the curvature that is expected of them while it lives, and a tilt beside it.
class SettledProblem::AsExpected {
 public:
  explicit AsExpected(SettledProblem& settled, const std::vector<Eigen::MatrixXd>* tilts = nullptr)
      : settled_(settled) {
    Problem& problem = settled.problem_;
    for (const Block& block : settled.student_t_) {
      saved_.emplace_back(problem.noise(block), problem.loss(block));
      const auto& [noise, loss] = saved_.back();
      const double weight = problem.weight(block) * expected_curvature(loss);
      if (tilts) {
        Eigen::MatrixXd curvature = (*tilts)[saved_.size() - 1];
        curvature.diagonal().array() += weight;
        const Eigen::MatrixXd root = curvature.llt().matrixU();
        problem.set_noise(block, Gaussian::square_root(root * noise.sqrt_information()));
      } else {
        problem.set_noise(block, noise.scaled(1 / std::sqrt(weight)));
      }
      problem.set_loss(block, {});
    }
  }
  ~AsExpected() {
    for (std::size_t i = saved_.size(); i-- > 0;) {
      settled_.problem_.set_noise(settled_.student_t_[i], saved_[i].first);
      settled_.problem_.set_loss(settled_.student_t_[i], saved_[i].second);
    }
  }
  AsExpected(const AsExpected&) = delete;

 private:
  SettledProblem& settled_;
  std::vector<std::pair<Gaussian, Loss>> saved_;
};

bool SettledProblem::find_covariances() {
  marginals_.reset();
  beliefs_marginals_.reset();
  const auto check = [this] { options_.stop.check(kWhat); };
  check();
  const bool beliefs = has_beliefs();
  bool found = false, found_of_beliefs = false;
  try {
    if (by_steps_) {
      linearize();
      const auto invert = [&](int which) {
        if (which == 0)
          found = inverse_.compute(hessian_, {}, check);
        else
          found_of_beliefs = beliefs_inverse_.compute(beliefs_hessian_, {}, check);
      };
      lanes_.run(beliefs ? 2 : 1, invert);
    }
    // Marginals say why not, or can where a pivot was weak.
    if (!found) marginals_.emplace(problem_, std::span<const Marginals::Pair>(), options_.stop);
    if (beliefs && !found_of_beliefs) {
      const Faint faint(*this);
      beliefs_marginals_.emplace(problem_, std::span<const Marginals::Pair>(), options_.stop);
    }
    return true;
  } catch (const Stopped&) {
    throw;
  } catch (const Error& error) {
    why_ = error.what();
    return false;
  }
}

/// Both Hessians at the solution, where they are not yet known.
void SettledProblem::linearize() {
  if (!linearized_) {
    program_.reset();
    program_.linearize(gradient_, hessian_);
    linearized_ = true;
  }
  if (!student_t_.empty()) {
    const AsExpected curvature(*this);
    program_.linearize(step_, hessian_);
  }
  if (!has_beliefs()) return;
  const Faint faint(*this);
  const double cost = program_.linearize(step_, beliefs_hessian_);
  hold_loosely();
  if (options_.whole_integral) step_to_beliefs(cost);
}

void SettledProblem::step_to_beliefs(double cost) {
  beliefs_cost_ = 0;
  beliefs_step_.resize(0);
  if (!cholesky_.factorize(beliefs_hessian_)) return;
  beliefs_step_ = -step_;
  cholesky_.solve(beliefs_step_);
  beliefs_cost_ = cost + 0.5 * step_.dot(beliefs_step_);
}

bool SettledProblem::invert_tilted(const std::vector<Eigen::MatrixXd>& tilts, SelectedInverse& inverse) {
  Eigen::VectorXd hessian(hessian_.size());
  {
    const AsExpected curvature(*this, &tilts);
    program_.linearize(step_, hessian);
  }
  return inverse.compute(hessian, {}, [this] { options_.stop.check(kWhat); });
}

bool SettledProblem::factorize(bool of_beliefs) {
  return by_steps_ && cholesky_.factorize(of_beliefs ? beliefs_hessian_ : hessian_);
}

bool SettledProblem::solve(Eigen::MatrixXd& columns, bool of_beliefs) {
  if (!factorize(of_beliefs)) return false;
  for (Eigen::Index i = 0; i < columns.cols(); ++i) {
    step_ = columns.col(i);
    cholesky_.solve(step_);
    columns.col(i) = step_;
  }
  return true;
}

void SettledProblem::take_hold(double share) {
  hold_.resize(program_.hessian_pattern().size());
  hessian_diagonal(program_.hessian_pattern(), hessian_, hold_);
  hold_ *= share;
}

/// Directions that beliefs leave free, and faint measurements do not hold for doubles, either, by the same for all noise.
void SettledProblem::hold_loosely() {
  const SymmetricPattern& pattern = program_.hessian_pattern();
  if (hold_.size() == 0) take_hold(kHold);
  for (int k = 0; k < pattern.num_blocks(); ++k)
    for (int i = 0; i < pattern.width(k); ++i)
      beliefs_hessian_[pattern.diagonal(k, i)] += hold_[pattern.first[std::size_t(k)] + i];
}

double SettledProblem::Covariances::log_determinant() const {
  return marginals ? marginals->log_determinant() : inverse->log_determinant();
}

Eigen::MatrixXd SettledProblem::Covariances::joint(const std::vector<int>& variable_ids,
                                                   const std::vector<int>& dofs) const {
  if (marginals) return marginals->joint(variable_ids, dofs);
  const int n = std::accumulate(dofs.begin(), dofs.end(), 0);
  Eigen::MatrixXd S = Eigen::MatrixXd::Zero(n, n);  // of fixed variables
  for (std::size_t a = 0, row = 0; a < dofs.size(); row += std::size_t(dofs[a++]))
    for (std::size_t b = 0, column = 0; b <= a; column += std::size_t(dofs[b++])) {
      const int p = program->block_of(variable_ids[a]), q = program->block_of(variable_ids[b]);
      if (p < 0 || q < 0) continue;
      auto block = S.block(Eigen::Index(row), Eigen::Index(column), dofs[a], dofs[b]);
      inverse->block(p, q, block);
      if (a != b) S.block(Eigen::Index(column), Eigen::Index(row), dofs[b], dofs[a]) = block.transpose();
    }
  return S;
}

}  // namespace tandem::detail
