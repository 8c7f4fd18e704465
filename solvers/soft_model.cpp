#include <algorithm>
#include <limits>
#include <optional>
#include <utility>

#include <tandem/lie/error.hpp>
#include <tandem/problem/prefault.hpp>
#include <tandem/solvers/damped_step.hpp>
#include <tandem/solvers/linear/hessian_diagonal.hpp>
#include <tandem/solvers/soft_model.hpp>

namespace tandem::detail {
namespace {

constexpr int kMinParallelBlocks = 1300;  // minimum number of blocks for parallel tasks
// Scale of strong damping of an unknown, relative to the largest one of the same variable. Some curvature vanishes at
// certain points, for example the curvature of a range across the line of sight. Without this scale, the unknown would
// be undamped there.
constexpr double kLeastScale = 1e-2;
// Consecutive steps with the exact Hessian that are rejected, and that are damped.
constexpr int kMaxRejections = 3, kMaxDamped = 5;

}  // namespace

SoftModel::SoftModel(NlpEvaluator& nlp, Session& session, const LevenbergMarquardtOptions& options,
                     bool with_constraints)
    : nlp_(nlp),
      session_(session),
      parts_(nlp.tasks(), nlp.num_unknowns()),
      blocks_(nlp.tasks(), nlp.hessian_pattern().num_blocks(), kMinParallelBlocks),
      cholesky_(compile()),
      secant_(parts_, nlp.num_unknowns(), with_constraints ? 0 : options.secant_pairs) {
  cholesky_.use(nlp.tasks());
}

/// Analyses the Hessian and allocates the other vectors at the same time.
BlockCholesky SoftModel::compile() {
  const SymmetricPattern& pattern = nlp_.hessian_pattern();
  std::optional<BlockCholesky> cholesky;
  const auto make = [&](int task) {
    if (task == 0) {
      cholesky.emplace(pattern);
      return;
    }
    hessian_.resize(pattern.nonzeros());
    prefault(hessian_, std::size_t(hessian_.size()));
    for (Eigen::VectorXd* v : {&gradient_, &trial_gradient_, &last_gradient_, &scale_, &step_}) {
      v->resize(pattern.size());
      prefault(*v, std::size_t(v->size()));
      v->setZero();
    }
  };
  if (pattern.num_blocks() >= kMinParallelBlocks) {
    nlp_.tasks().run(2, make);
  } else {
    make(0);
    make(1);
  }
  return std::move(*cholesky);
}

double SoftModel::linearize() {
  const Session::Timer timer(session_.summary.evaluation_seconds);
  ++session_.summary.evaluations;
  use_exact_ = exact_is_current_ = false;
  hessian_is_current_ = false;
  const double cost = nlp_.linearize(gradient_, hessian_);
  hessian_is_current_ = true;
  find_scale();
  return cost;
}

void SoftModel::restore_hessian() {
  if (hessian_is_current_) return;
  const Session::Timer timer(session_.summary.evaluation_seconds);
  ++session_.summary.evaluations;
  nlp_.reset();
  nlp_.linearize(trial_gradient_, hessian_);
  hessian_is_current_ = true;
}

void SoftModel::find_scale() {
  const SymmetricPattern& pattern = nlp_.hessian_pattern();
  const double flattest = -blocks_.max([&](Eigen::Index first, Eigen::Index blocks) {
    const int end = int(first + blocks);
    hessian_diagonal(pattern, int(first), end, hessian_, scale_);
    double flattest = std::numeric_limits<double>::infinity();
    for (int k = int(first); k < end; ++k) {
      auto scale = scale_.segment(pattern.first[std::size_t(k)], pattern.width(k));
      const double rounding = kRoundingCurvature * scale.maxCoeff();
      flattest = std::min(flattest, scale.minCoeff() - rounding);
      if (scale.minCoeff() > rounding) continue;
      const int width = pattern.width(k), stride = pattern.height(k);
      const double* block = hessian_.data() + pattern.value_start[std::size_t(k)];
      const auto curvature = [&](int i) { return block[i * (stride + 1)]; };
      for (int i = 0; i < width; ++i)
        if (!(scale[i] > kRoundingCurvature * largest_coupled(block, stride, width, i, curvature))) scale[i] = 0;
    }
    return -flattest;
  });
  all_curved_ = flattest > 0;
}

std::string SoftModel::nonfinite_block() {
  const double sum = parts_.sum([this](Eigen::Index begin, Eigen::Index size) {
    return gradient_.segment(begin, size).sum() + scale_.segment(begin, size).sum();
  });
  if (std::isfinite(sum)) return {};
  nlp_.reset();
  return nlp_.describe_nonfinite_block();
}

double SoftModel::scaled(const Eigen::VectorXd& gradient) const {
  return std::sqrt(parts_.max([&](Eigen::Index begin, Eigen::Index size) {
    double largest = 0;
    for (Eigen::Index i = begin; i < begin + size; ++i)
      if (scale_[i] > 0) largest = std::max(largest, gradient[i] * gradient[i] / scale_[i]);
    return largest;
  }));
}

double SoftModel::step_size() const {
  return parts_.max(
      [this](Eigen::Index begin, Eigen::Index size) { return step_.segment(begin, size).cwiseAbs().maxCoeff(); });
}

void SoftModel::damp(const Eigen::VectorXd& hessian, double damping, Eigen::VectorXd& damped) const {
  const SymmetricPattern& pattern = nlp_.hessian_pattern();
  blocks_.each([&](int, Eigen::Index first, Eigen::Index blocks) {
    for (int k = int(first); k < first + blocks; ++k) {
      const int begin = pattern.value_start[std::size_t(k)], height = pattern.height(k), width = pattern.width(k);
      if (&hessian != &damped) damped.segment(begin, height * width) = hessian.segment(begin, height * width);
      const auto scale = scale_.segment(pattern.first[std::size_t(k)], width);
      const double least = std::min(damping, kLeastScale) * scale.maxCoeff();
      // The damping is relative to `scale`, because second derivatives may make a diagonal entry smaller.
      const auto curvature = [&](int i) { return std::max(damped[begin + i * (height + 1)], scale[i]); };
      for (int i = 0; i < width; ++i) {
        double& d = damped[begin + i * (height + 1)];
        d += damping_shift(damping, std::max(scale[i], least), all_curved_ ? 1.0 : curvature(i),
                           all_curved_ ? 1.0 : largest_coupled(&damped[begin], height, width, i, curvature));
      }
    }
  });
}

double SoftModel::hidden_gain(double damping) const {
  const SymmetricPattern& pattern = nlp_.hessian_pattern();
  double gain = 0;
  for (int k = 0; k < pattern.num_blocks(); ++k) {
    const int first = pattern.first[std::size_t(k)], width = pattern.width(k);
    const double shift = damping * std::min(damping, kLeastScale) * scale_.segment(first, width).maxCoeff();
    for (int i = first; i < first + width; ++i)
      if (scale_[i] > 0 && scale_[i] < shift) gain += 0.5 * gradient_[i] * gradient_[i] / scale_[i];
  }
  return gain;
}

/// Changes between the Hessians when the present one fails, as NL2SOL does (Dennis, Gay & Welsch 1981). In a long chain,
/// each part has its own second derivatives, which a few secant pairs cannot represent. In a curved valley, the exact
/// Hessian predicts worse.
void SoftModel::choose_hessian(const StepQuality& quality) {
  rejected_ = quality.rejected ? rejected_ + 1 : 0;
  damped_ = use_exact_ && !quality.undamped ? damped_ + 1 : 0;
  if (damped_ > kMaxDamped) abandon_exact_hessian();
  const bool failed = use_exact_ ? rejected_ > kMaxRejections : quality.rejected || quality.underestimated;
  if (failed && exact_allowed_ && nlp_.has_cheap_curvature()) {
    use_exact_ = !use_exact_;
    rejected_ = 0;
  }
  if (!use_exact_ || exact_is_current_) return;
  restore_hessian();
  const Session::Timer timer(session_.summary.evaluation_seconds);
  exact_hessian_.resize(hessian_.size());
  try {
    nlp_.curvature({}, exact_hessian_);
    exact_hessian_ += hessian_;
    exact_is_current_ = true;
  } catch (const UndefinedResidualError&) {  // a residual is undefined at a finite-difference point
    use_exact_ = false;
  }
}

bool SoftModel::abandon_exact_hessian() {
  exact_allowed_ = false;
  return std::exchange(use_exact_, false);
}

bool SoftModel::find_step(double damping) {
  if (!use_exact_) restore_hessian();
  const Session::Timer timer(session_.summary.linear_solver_seconds);
  damp(use_exact_ ? exact_hessian_ : hessian_, damping, hessian_);
  hessian_is_current_ = false;
  if (!cholesky_.factorize_in_place(hessian_)) return false;
  parts_.each([this](int, Eigen::Index begin, Eigen::Index size) {
    step_.segment(begin, size) = -gradient_.segment(begin, size);
  });
  const auto solve = [&](Eigen::VectorXd& d) { cholesky_.solve(d); };
  use_exact_ ? solve(step_) : secant_.apply(step_, solve);
  predicted_ = -0.5 * parts_.sum([this](Eigen::Index begin, Eigen::Index size) {  // because (H + D) p = −g
    return gradient_.segment(begin, size).dot(step_.segment(begin, size));
  });
  return true;
}

double SoftModel::merit_at_step(bool with_derivatives) {
  const Session::Timer timer(session_.summary.evaluation_seconds);
  ++session_.summary.evaluations;
  trial_has_derivatives_ = with_derivatives;
  try {
    nlp_.move_to(step_);
    hessian_is_current_ = hessian_is_current_ && !with_derivatives;
    trial_cost_ = with_derivatives ? nlp_.linearize_at_point(trial_gradient_, hessian_) : nlp_.cost();
    return trial_cost_;
  } catch (const UndefinedResidualError&) {
    return std::numeric_limits<double>::infinity();
  }
}

void SoftModel::move() {
  hessian_is_current_ = exact_is_current_ = false;
  nlp_.recenter();
  session_.summary.cost = trial_cost_;
}

bool SoftModel::move_on() {
  const Session::Timer timer(session_.summary.evaluation_seconds);
  const double cost_before = session_.summary.cost;
  move();
  try {
    if (!trial_has_derivatives_) nlp_.linearize(trial_gradient_, hessian_);
    linearize_constraints();
  } catch (const UndefinedResidualError&) {
    last_gradient_ = -step_;
    nlp_.move_to(last_gradient_);
    nlp_.recenter();
    session_.summary.cost = cost_before;
    linearize_constraints();
    return false;
  }
  last_gradient_.swap(gradient_);
  gradient_.swap(trial_gradient_);
  hessian_is_current_ = true;
  find_scale();
  on_new_point();
  return true;
}

void SoftModel::add_secant_pair() { secant_.add(step_, last_gradient_, gradient_); }

}  // namespace tandem::detail
