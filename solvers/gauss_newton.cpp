#include <algorithm>
#include <cmath>
#include <limits>

#include <tandem/solvers/block_cholesky.hpp>
#include <tandem/solvers/gauss_newton.hpp>
#include <tandem/solvers/hessian_diagonal.hpp>
#include <tandem/solvers/secant.hpp>
#include <tandem/solvers/session.hpp>

namespace tandem {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kMaxDamping = 1e16;
constexpr double kSmallestDamping = 1e-15;
constexpr double kSecantBelow = 1e-2;  // relative drop of the cost in one step

class LevenbergMarquardt {
 public:
  LevenbergMarquardt(Problem& problem, const GaussNewtonOptions& options)
      : options_(options),
        session_("gauss-newton", options),
        program_(problem),
        cholesky_(program_.hessian_pattern()),
        secant_(program_.num_unknowns(), options.secant_pairs) {
    const int n = program_.num_unknowns();
    gradient_.resize(n);
    trial_gradient_.resize(n);
    scale_.resize(n);
    shift_.resize(n);
    step_.resize(n);
    hessian_.resize(static_cast<Eigen::Index>(program_.hessian_pattern().row.size()));
    trial_hessian_.resize(hessian_.size());
  }

  Summary run() {
    auto& s = session_.summary;
    if (!session_.start(program_, [this] { return linearize(); })) return s;
    update_scale();
    double damping = options_.initial_damping, growth = 4;
    while (!session_.ended()) {
      session_.report(s.iterations, s.cost, s.iterations ? step_.norm() : 0.0, 0.0);
      if (session_.should_stop()) break;
      if (s.iterations >= options_.max_iterations) {
        session_.end(Status::max_iterations);
        break;
      }
      if (!std::isfinite(gradient_.sum()) || !std::isfinite(scale_.sum())) {
        program_.reset();
        session_.end(Status::failed, "a Jacobian is not finite, in " + program_.describe_bad_block());
        break;
      }
      if (scaled_gradient() <= options_.gradient_tolerance * std::sqrt(1 + s.cost)) {
        session_.end(Status::converged, "the gradient vanished");
        break;
      }
      ++s.iterations;
      const bool accepted = try_step(damping, growth);
      if (!accepted && damping > kMaxDamping) end_when_nothing_is_left();
    }
    session_.conclude(program_, 0.0);
    return s;
  }

 private:
  double linearize() {
    const detail::Session::Timer timer(session_.summary.evaluation_seconds);
    ++session_.summary.evaluations;
    return program_.linearize(gradient_, hessian_);
  }

  /// The Hessian's diagonal, the scale of each unknown.
  void update_scale() { detail::hessian_diagonal(program_.hessian_pattern(), hessian_, scale_); }

  /// Largest |g| in units in which each unknown has unit curvature.
  double scaled_gradient() const {
    double largest = 0;
    for (Eigen::Index i = 0; i < gradient_.size(); ++i)
      if (scale_[i] > 0) largest = std::max(largest, std::abs(gradient_[i]) / std::sqrt(scale_[i]));
    return largest;
  }

  bool factorize(double damping) {
    const detail::Session::Timer timer(session_.summary.linear_solver_seconds);
    // An unknown that no residual curves still gets a pivot, and then no step.
    shift_ = (damping * scale_).cwiseMax(std::numeric_limits<double>::min());
    for (Eigen::Index i = 0; i < shift_.size(); ++i)
      if (!(scale_[i] > 0)) shift_[i] = 1.0;
    if (!cholesky_.factorize(hessian_, shift_)) return false;
    step_ = -gradient_;
    secant_.apply(step_, [&](Eigen::VectorXd& d) { cholesky_.solve(d); });
    return true;
  }

  /// Cost after the step. While steps are good, with the derivatives there, since they will be wanted next.
  double cost_at_step() {
    const detail::Session::Timer timer(session_.summary.evaluation_seconds);
    ++session_.summary.evaluations;
    try {
      program_.move_to(step_);
      return confident_ ? program_.linearize_at_point(trial_gradient_, trial_hessian_) : program_.cost();
    } catch (const Error&) {
      return kInfinity;  // undefined there: shorten the step
    }
  }

  /// Derivatives at the point just accepted.
  void adopt_derivatives() {
    if (!confident_) {
      const detail::Session::Timer timer(session_.summary.evaluation_seconds);
      program_.linearize(trial_gradient_, trial_hessian_);
    }
    gradient_.swap(trial_gradient_);  // the trial's is now the last one
    hessian_.swap(trial_hessian_);
    update_scale();
  }

  /// One trial step; `damping` and its `growth` follow Nielsen (1999).
  bool try_step(double& damping, double& growth) {
    auto& s = session_.summary;
    const auto refuse = [&] {
      program_.reset();
      damping = std::max(damping, 1e-12) * growth;
      growth *= 2;
      secant_.clear();
      confident_ = false;
      return false;
    };
    if (!factorize(damping)) return refuse();
    const double predicted = -0.5 * gradient_.dot(step_);  // of the model that the step minimises
    const double trial = cost_at_step();
    const double noise = 1e-14 * s.cost;  // differences below this are rounding
    if (predicted <= noise) {             // at a solution, or damped until nothing moves
      if (trial <= s.cost) accept(trial);
      end_when_nothing_is_left();
      return true;
    }
    const double ratio = (s.cost - trial) / predicted;
    if (!(ratio > 1e-4)) {
      if (predicted <= options_.cost_tolerance * s.cost && damping <= options_.initial_damping) {
        session_.end(Status::converged, "the cost changes no more");
        return true;
      }
      return refuse();
    }
    const double drop = s.cost - trial;
    const double before = s.cost;
    accept(trial);
    const bool free_step = damping <= options_.initial_damping;  // else the damping made it small
    if (free_step && drop <= options_.cost_tolerance * before && predicted <= options_.cost_tolerance * before) {
      session_.end(Status::converged, "the cost changes no more");
    } else if (free_step && step_.cwiseAbs().maxCoeff() <= options_.step_tolerance) {
      session_.end(Status::converged, "the steps have become too small to matter");
    } else {
      adopt_derivatives();
      // Far away, where the cost still falls fast, the curvature of one place says little about the next.
      if (drop <= kSecantBelow * before) secant_.add(step_, trial_gradient_, gradient_);
    }
    confident_ = ratio > 0.1;
    damping = std::max(kSmallestDamping, damping * std::max(0.1, 1 - std::pow(2 * ratio - 1, 3)));
    growth = 4;
    return true;
  }

  /// Converged when a Gauss-Newton step would gain nothing either, failed when it would.
  void end_when_nothing_is_left() {
    program_.reset();
    secant_.clear();
    linearize();
    update_scale();
    const double least = std::max(options_.cost_tolerance, 1e-14) * session_.summary.cost;
    if (factorize(options_.initial_damping) && -0.5 * gradient_.dot(step_) <= least) {
      session_.end(Status::converged, "no step lowers the cost any further");
    } else {
      session_.end(Status::failed, "no step lowers the cost, however short: is a Jacobian wrong?");
    }
  }

  void accept(double cost) {
    program_.recenter();
    session_.summary.cost = cost;
  }

  const GaussNewtonOptions& options_;
  detail::Session session_;
  Program program_;
  BlockCholesky cholesky_;
  detail::SecantPairs secant_;
  bool confident_ = true;  // the last step was good
  Eigen::VectorXd gradient_, trial_gradient_, hessian_, trial_hessian_, scale_, shift_, step_;
};

}  // namespace

std::string why_unsupported(const Problem& problem, const GaussNewtonOptions& options) {
  if (!(options.cost_tolerance >= 0) || !(options.gradient_tolerance >= 0) || !(options.step_tolerance >= 0) ||
      !(options.initial_damping >= 0) || options.secant_pairs < 0)
    throw Error("gauss-newton: tolerances, initial_damping and secant_pairs must not be negative");
  if (problem.num_hard_blocks() == 0) return detail::why_unsolvable(problem);
  return "gauss-newton takes soft residuals only, and this problem has " + std::to_string(problem.num_hard_blocks()) +
         " hard ones: use ipopt, or nlopt for a small problem";
}

Summary solve(Problem& problem, const GaussNewtonOptions& options) {
  if (const std::string why = why_unsupported(problem, options); !why.empty()) {
    detail::Session session("gauss-newton", options);
    session.end(Status::unsupported, why);
    return session.summary;
  }
  return LevenbergMarquardt(problem, options).run();
}

}  // namespace tandem
