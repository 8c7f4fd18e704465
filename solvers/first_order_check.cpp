#include <algorithm>
#include <cmath>

#include <tandem/lie/error.hpp>
#include <tandem/solvers/active_rows.hpp>
#include <tandem/solvers/first_order_check.hpp>
#include <tandem/solvers/linear/block_cholesky.hpp>
#include <tandem/solvers/linear/hessian_diagonal.hpp>
#include <tandem/solvers/linear/jacobian_products.hpp>
#include <tandem/solvers/session.hpp>

namespace tandem::detail {
namespace {

/// Minimises ½ pᵀ D p + gᵀ p under the linearised active rows, whose multipliers are y. D p is then −(g + Jᵀ y).
class Multipliers {
 public:
  Multipliers(NlpEvaluator& nlp, double least_curvature)
      : nlp_(nlp),
        cholesky_(nlp.hessian_pattern()),
        hessian_(nlp.hessian_pattern().nonzeros()),
        curvature_(nlp.num_unknowns()),
        gradient_(nlp.num_unknowns()),
        p_(nlp.num_unknowns()),
        c_(nlp.num_rows()),
        jacobian_(Eigen::Index(nlp.jacobian_pattern().row.size())),
        y_(Eigen::VectorXd::Zero(nlp.num_rows())) {
    nlp_.reset();
    nlp_.linearize(gradient_, hessian_);
    nlp_.linearize_constraints(c_, jacobian_);
    hessian_diagonal(nlp_.hessian_pattern(), hessian_, curvature_);
    add_soft_rows();
    bound_curvature(least_curvature);
    find_candidates();
  }

  std::optional<FirstOrderCheck> find() {
    const Eigen::VectorXd met = Eigen::VectorXd::Zero(y_.size());
    for (int set = 0; set < kMaxActiveSets; ++set) {
      rows_.set(nlp_, jacobian_, active_, curvature_);
      hessian_.setZero();
      nlp_.add_constraint_hessian(rows_.weights(), jacobian_, hessian_);
      if (!cholesky_.factorize(hessian_, curvature_)) break;
      rows_.solve(cholesky_, gradient_, met, p_, y_, errors_);
      if (!rows_.refine(cholesky_, met, p_, y_, errors_)) break;
      if (!change_active_set(set < kManyActiveSets))
        return FirstOrderCheck{stationarity(), violated_row(nlp_, c_, kConstraintTolerance) < 0, y_};
    }
    return {};
  }

 private:
  /// Adds the cost of soft bounds that are rows.
  void add_soft_rows() {
    const TripletPattern& pattern = nlp_.jacobian_pattern();
    for (std::size_t k = 0; k < pattern.row.size(); ++k) {
      const int row = pattern.row[k];
      const double J = jacobian_[Eigen::Index(k)],
                   outside = c_[row] - std::clamp(c_[row], nlp_.lower()[row], nlp_.upper()[row]);
      if (outside == 0) continue;
      gradient_[pattern.column[k]] += nlp_.soft_weights()[row] * outside * J;
      curvature_[pattern.column[k]] += nlp_.soft_weights()[row] * J * J;
    }
  }

  void bound_curvature(double relative) {
    const double largest = curvature_.maxCoeff(), least = relative * largest;
    double softest = largest;
    for (const double d : curvature_)
      if (d > 0) softest = std::clamp(d, least, softest);
    for (double& d : curvature_) d = !(largest > 0) ? 1.0 : d > 0 ? std::max(d, least) : softest;
  }

  void find_candidates() {
    active_.assign(std::size_t(c_.size()), ActiveRows::inactive);
    has_sign_.assign(std::size_t(c_.size()), true);
    rows_.set(nlp_, jacobian_, active_, curvature_);
    for (Eigen::Index i = 0; i < c_.size(); ++i) {
      const double above = nlp_.upper()[i] - c_[i], below = c_[i] - nlp_.lower()[i];
      const double near = kAtBound / rows_.root_stiffness(i);
      if (nlp_.soft_weights()[i] > 0 || std::min(above, below) > near) continue;
      active_[std::size_t(i)] = above <= below ? ActiveRows::upper : ActiveRows::lower;
      has_sign_[std::size_t(i)] = std::max(above, below) > near;
    }
    candidates_ = active_;
  }

  /// Drops rows whose multiplier has the wrong sign, and activates candidates that p violates: all of them, or the
  /// worst one. Returns whether a row has changed.
  bool change_active_set(bool all) {
    Eigen::VectorXd along = Eigen::VectorXd::Zero(c_.size());
    add_jacobian_product(nlp_.jacobian_pattern(), jacobian_, p_, along);
    std::size_t worst_row = 0;
    double worst = kWrongSign;
    bool changed = false;
    for (std::size_t i = 0; i < active_.size(); ++i) {
      const auto row = Eigen::Index(i);
      if (candidates_[i] == ActiveRows::inactive || !has_sign_[i]) continue;
      const double wrong = active_[i] ? -int(active_[i]) * y_[row] / rows_.root_stiffness(row)
                                      : int(candidates_[i]) * along[row] * rows_.root_stiffness(row);
      if (wrong <= (all ? kWrongSign : worst)) {
        if (active_[i] && int(active_[i]) * y_[row] < 0 && wrong <= kWrongSign) y_[row] = 0;
        continue;
      }
      changed = true;
      worst = wrong;
      worst_row = i;
      if (all) change(i);
    }
    if (changed && !all) change(worst_row);
    return changed;
  }

  void change(std::size_t i) {
    active_[i] = active_[i] ? ActiveRows::inactive : candidates_[i];
    y_[Eigen::Index(i)] = 0;
  }

  double stationarity() const {
    Eigen::VectorXd terms = gradient_.cwiseAbs();
    add_transposed_product(nlp_.jacobian_pattern(), jacobian_.cwiseAbs(), y_.cwiseAbs(), terms);
    const Eigen::ArrayXd root = curvature_.array().sqrt();
    return (root * p_.array().abs() / (1.0 + terms.array() / root)).maxCoeff();
  }

  static constexpr double kAtBound = 1e-4;  // distance of a row that may be active from its bound [standard deviations]
  static constexpr double kWrongSign = 1e-9;                      // of a multiplier [standard deviations]
  static constexpr int kMaxActiveSets = 60, kManyActiveSets = 5;  // after the latter, one row at a time changes

  NlpEvaluator& nlp_;
  BlockCholesky cholesky_;
  Eigen::VectorXd hessian_, curvature_, gradient_, p_, c_, jacobian_, y_, errors_;
  std::vector<ActiveRows::Side> active_, candidates_;
  std::vector<bool> has_sign_;  // false at an equality, and where both bounds are near
  ActiveRows rows_;
};

}  // namespace

std::optional<FirstOrderCheck> check_first_order(NlpEvaluator& nlp, double least_curvature) try {
  return Multipliers(nlp, least_curvature).find();
} catch (const UndefinedResidualError&) {
  nlp.reset();
  return {};
}

}  // namespace tandem::detail
