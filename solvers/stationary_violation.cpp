#include <cmath>
#include <limits>

#include <tandem/lie/error.hpp>
#include <tandem/solvers/linear/block_cholesky.hpp>
#include <tandem/solvers/linear/hessian_diagonal.hpp>
#include <tandem/solvers/stationary_violation.hpp>

namespace tandem::detail {
namespace {

/// Minimises the violation from X̄.
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
        delta_(Eigen::VectorXd::Zero(nlp.num_unknowns())),
        diagonal_(nlp.num_unknowns()) {}

  bool reduces_significantly() {
    nlp_.reset();
    const Size before = evaluate();
    Size now = before;
    for (int step = 0; step < kMaxSteps && now.squares > 0; ++step)
      if (!take_step(now)) break;
    nlp_.reset();
    return now.squares < kSignificant * before.squares && now.sum < kSignificant * before.sum;
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

  /// Takes a step that reduces the sum of squares. Rows that a rejected step violates are kept within their bounds by
  /// the next one.
  bool take_step(Size& now) {
    nlp_.move_to(delta_);
    evaluate();
    Eigen::VectorXd here = c_, target = v_, active = weights_;
    nlp_.constraint_jacobian(jacobian_);
    while (damping_ <= kMaxDamping) {
      const Eigen::VectorXd next = delta_ + step(target, active);
      const Size then = size_at(next);
      if (then.squares < now.squares) {
        now = then;
        delta_ = next;
        damping_ *= 0.1;
        return true;
      }
      bool added = false;
      for (Eigen::Index i = 0; i < v_.size() && std::isfinite(then.squares); ++i) {
        if (v_[i] == 0 || active[i] != 0) continue;
        active[i] = 1;
        target[i] = here[i] - (v_[i] > 0 ? nlp_.upper()[i] : nlp_.lower()[i]);
        added = true;
      }
      if (!added) damping_ *= 10;
    }
    return false;
  }

  /// Returns the damped minimiser of ‖target + J s‖² over the active rows.
  Eigen::VectorXd step(const Eigen::VectorXd& target, const Eigen::VectorXd& active) {
    Eigen::VectorXd s = Eigen::VectorXd::Zero(nlp_.num_unknowns());
    const TripletPattern& pattern = nlp_.jacobian_pattern();
    for (std::size_t k = 0; k < pattern.row.size(); ++k)
      s[pattern.column[k]] -= jacobian_[Eigen::Index(k)] * target[pattern.row[k]];
    hessian_.setZero();
    nlp_.add_constraint_hessian(active, jacobian_, hessian_);
    hessian_diagonal(nlp_.hessian_pattern(), hessian_, diagonal_);
    if (!cholesky_.factorize_shifted(hessian_, diagonal_, damping_)) return Eigen::VectorXd::Zero(s.size());
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

  static constexpr int kMaxSteps = 10;  // accepted steps; a few reduce a violation that is not stationary
  static constexpr double kSignificant =
      0.95;  // ratio of the violations after and before, below which X̄ is not a minimum
  static constexpr double kInitialDamping = 1e-3;  // relative to the diagonal of JᵀJ
  static constexpr double kMaxDamping = 1e6;
  static constexpr double kMaxAngle = 2.0;  // [rad]; the chart ends at π

  NlpEvaluator& nlp_;
  BlockCholesky cholesky_;
  Eigen::VectorXd c_, v_, weights_, jacobian_, hessian_, delta_, diagonal_;
  double damping_ = kInitialDamping;
};

}  // namespace

bool violation_is_stationary(NlpEvaluator& nlp) try {
  return !ViolationMinimization(nlp).reduces_significantly();
} catch (const Error&) {  // derivatives are undefined: no step can be computed
  nlp.reset();
  return true;
}

}  // namespace tandem::detail
