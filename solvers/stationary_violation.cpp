#include <cmath>
#include <limits>
#include <utility>

#include <tandem/lie/error.hpp>
#include <tandem/solvers/linear/block_cholesky.hpp>
#include <tandem/solvers/linear/hessian_diagonal.hpp>
#include <tandem/solvers/linear/jacobian_products.hpp>
#include <tandem/solvers/session.hpp>
#include <tandem/solvers/stationary_violation.hpp>

namespace tandem::detail {
namespace {

/// Minimises the violation from X̄ by damped Newton steps: Gauss-Newton steps while these converge fast.
class ViolationMinimization {
 public:
  explicit ViolationMinimization(NlpEvaluator& nlp)
      : nlp_(nlp),
        cholesky_(nlp.hessian_pattern()),
        c_(nlp.num_rows()),
        v_(nlp.num_rows()),
        weights_(nlp.num_rows()),
        jacobian_(Eigen::Index(nlp.jacobian_pattern().row.size())),
        hessian_(nlp.hessian_pattern().nonzeros()),
        curvature_(nlp.hessian_pattern().nonzeros()),
        delta_(Eigen::VectorXd::Zero(nlp.num_unknowns())),
        scale_(nlp.num_unknowns()),
        curvature_scale_(nlp.num_unknowns()) {}

  bool reduces_significantly() {
    constexpr int kFewSteps = 10;  // they reduce a violation that is not stationary
    nlp_.reset();
    const Size before = evaluate();
    Size now = before;
    for (int step = 0; step < kFewSteps && now.squares > 0; ++step)
      if (!take_step(now)) break;
    nlp_.reset();
    return now.squares < kSignificant * before.squares && now.sum < kSignificant * before.sum;
  }

  LeastViolation run(const std::function<bool()>& should_stop) {
    nlp_.reset();
    Size now = evaluate();
    for (int step = 0; step < kMaxSteps; ++step) {
      if (violated_row(nlp_, c_, kConstraintTolerance) < 0) return LeastViolation::feasible;
      if (should_stop()) return LeastViolation::unfinished;
      const double before = now.squares;
      const bool moved = take_step(now);
      nlp_.move_to(delta_);
      nlp_.recenter();
      delta_.setZero();
      evaluate();
      if (slope_ <= (moved ? kStationary : kNearlyStationary) && now.squares > kNoGain * before)
        return LeastViolation::stationary;
      if (!moved) break;
    }
    return LeastViolation::unfinished;
  }

 private:
  struct Size {
    double squares, sum;
  };

  /// Sets the violations v and the weights of the active rows. Returns the size of v at the point.
  Size evaluate() {
    nlp_.constraints(c_);
    for (Eigen::Index i = 0; i < c_.size(); ++i) {
      const double lower = nlp_.lower()[i], upper = nlp_.upper()[i];
      const bool hard = nlp_.soft_weights()[i] == 0;
      v_[i] = hard ? std::max(c_[i] - upper, 0.0) - std::max(lower - c_[i], 0.0) : 0.0;
      weights_[i] = hard && (v_[i] != 0 || lower == upper) ? 1.0 : 0.0;
    }
    return {v_.squaredNorm(), v_.lpNorm<1>()};
  }

  /// Takes a step that reduces the sum of squares, if necessary with the curvature of the rows. Without it, directions
  /// along which the rows do not change to first order are undamped.
  bool take_step(Size& now) {
    if (try_step(now)) return true;
    if (std::exchange(slow_, true)) return false;
    return try_step(now);
  }

  /// Tries steps with more and more damping until one reduces the sum of squares. Rows that a rejected step violates are
  /// kept within their bounds by the next one. More damping begins the search anew without these rows. Without them, a
  /// short step descends.
  bool try_step(Size& now) {
    nlp_.move_to(delta_);
    evaluate();
    const Eigen::VectorXd here = c_, violated = v_, of_violated = weights_;
    nlp_.constraint_jacobian(jacobian_);
    find_curvature();
    find_slope(now);
    for (; damping_ <= kMaxDamping; damping_ *= 10) {
      Eigen::VectorXd target = violated, active = of_violated;
      for (bool added = true; added;) {
        const Eigen::VectorXd next = delta_ + step(target, active);
        const Size then = size_at(next);
        if (then.squares < now.squares) {
          slow_ = then.squares > kSlow * now.squares;
          now = then;
          delta_ = next;
          damping_ *= 0.1;
          return true;
        }
        added = false;
        for (Eigen::Index i = 0; i < v_.size() && std::isfinite(then.squares); ++i) {
          if (v_[i] == 0 || active[i] != 0) continue;
          active[i] = 1;
          target[i] = here[i] - (v_[i] > 0 ? nlp_.upper()[i] : nlp_.lower()[i]);
          added = true;
        }
      }
    }
    damping_ = kInitialDamping;
    return false;
  }

  /// Evaluates Σ vᵢ ∇²cᵢ if Gauss-Newton steps converge slowly.
  void find_curvature() try {
    curvature_.setZero();
    if (slow_) nlp_.exact_hessian(0.0, v_, curvature_);
  } catch (const UndefinedResidualError&) {  // a residual is undefined at a finite-difference point
    curvature_.setZero();
  }

  /// Sets the scale of the damping, and the slope of the violation at the point relative to its size and to the rows
  /// that are violated. Curvature counts in both: the gradient of a row may vanish where the row is extreme.
  void find_slope(const Size& now) {
    const auto find_scale = [this](const Eigen::VectorXd& weights) {
      hessian_.setZero();
      nlp_.add_constraint_hessian(weights, jacobian_, hessian_);
      hessian_diagonal(nlp_.hessian_pattern(), hessian_, scale_);
      scale_ = scale_.cwiseMax(curvature_scale_);
    };
    hessian_diagonal(nlp_.hessian_pattern(), curvature_, curvature_scale_);
    curvature_scale_ = curvature_scale_.cwiseAbs();
    find_scale(v_.cwiseAbs() / v_.lpNorm<Eigen::Infinity>());
    const Eigen::VectorXd unit = (scale_.array() > 0).select(scale_, 1.0).cwiseSqrt();
    slope_ = downhill(v_).cwiseQuotient(unit).cwiseAbs().maxCoeff() / std::sqrt(now.squares);
    find_scale(weights_);
  }

  /// Returns −Jᵀ v.
  Eigen::VectorXd downhill(const Eigen::VectorXd& v) const {
    Eigen::VectorXd s = Eigen::VectorXd::Zero(nlp_.num_unknowns());
    add_transposed_product(nlp_.jacobian_pattern(), jacobian_, -v, s);
    return s;
  }

  /// Returns the damped minimiser of ‖target + J s‖² over the active rows, with the curvature of the rows.
  Eigen::VectorXd step(const Eigen::VectorXd& target, const Eigen::VectorXd& active) {
    Eigen::VectorXd s = downhill(target);
    hessian_ = curvature_;
    nlp_.add_constraint_hessian(active, jacobian_, hessian_);
    if (!cholesky_.factorize_shifted(hessian_, scale_, damping_)) return Eigen::VectorXd::Zero(s.size());
    cholesky_.solve(s);
    return s;
  }

  Size size_at(const Eigen::VectorXd& delta) try {
    nlp_.move_to(delta);
    if (nlp_.largest_angle() <= kMaxAngle) return evaluate();
    return {std::numeric_limits<double>::infinity(), 0.0};
  } catch (const Error&) {  // a residual is undefined there
    return {std::numeric_limits<double>::infinity(), 0.0};
  }

  static constexpr int kMaxSteps = 100;
  static constexpr double kSlow = 0.5;          // ratio of the sums of squares after and before a step
  static constexpr double kSignificant = 0.95;  // ratio of the violations below which X̄ is not a minimum
  // Slopes of the violation, relative to its size, at a stationary point. The second counts if rounding ends the steps.
  static constexpr double kStationary = 1e-4, kNearlyStationary = 1e-2;
  static constexpr double kNoGain = 0.99;          // ratio of the sums of squares after and before a step
  static constexpr double kInitialDamping = 1e-3;  // relative to the diagonal of JᵀJ
  static constexpr double kMaxDamping = 1e6;
  static constexpr double kMaxAngle = 2.0;  // [rad]; the chart ends at π

  NlpEvaluator& nlp_;
  BlockCholesky cholesky_;
  Eigen::VectorXd c_, v_, weights_, jacobian_, hessian_, curvature_, delta_, scale_, curvature_scale_;
  double damping_ = kInitialDamping;
  double slope_ = std::numeric_limits<double>::infinity();  // at the point before the last step
  bool slow_ = true;                                        // the last step reduced the violation slowly, or none yet
};

}  // namespace

bool violation_is_stationary(NlpEvaluator& nlp) try {
  return !ViolationMinimization(nlp).reduces_significantly();
} catch (const Error&) {  // derivatives are undefined: no step can be computed
  nlp.reset();
  return true;
}

LeastViolation minimize_violation(NlpEvaluator& nlp, const std::function<bool()>& should_stop) try {
  return ViolationMinimization(nlp).run(should_stop);
} catch (const UndefinedResidualError&) {
  nlp.reset();
  return LeastViolation::unfinished;
}

}  // namespace tandem::detail
