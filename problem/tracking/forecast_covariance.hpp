#pragma once

#include <Eigen/Core>

namespace tandem::detail {

/// Joint covariance of [chaser; target before; target now] in a forecast. Prediction steps move the target; the chaser
/// is its newest pose and does not move. There are at most 24 unknowns.
class ForecastCovariance {
 public:
  using Vector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 24, 1>;
  using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, 24, 24>;
  using Given = Eigen::Ref<const Eigen::MatrixXd>;
  using GivenVector = Eigen::Ref<const Eigen::VectorXd>;

  /// `chaser` and `before` are the numbers of unknowns of the chaser and of the target before.
  ForecastCovariance(const Given& covariance, int chaser, int before);

  /// Predicts the next target state, x = J · [before; now] + w, where w has the covariance `noise`. Then "before" is
  /// the first part of "now", and "now" is x. Returns false if rounding dominates a variance in its first `positions`
  /// rows.
  bool predict(const Given& J, const Given& noise, int positions);
  /// Predicts the next target state x from the implicit equation J_next · x + J · [before; now] = w.
  bool predict(const Given& J_next, const Given& J, const Given& noise, int positions);

  /// Applies the measurement r = 0 with standard deviations `sigma`. J is the Jacobian with respect to the target's
  /// unknowns from index `first`. Returns the correction of [before; now].
  Vector update(const GivenVector& r, int first, const Given& J, const GivenVector& sigma);

  /// Returns the covariance of [chaser; J · now].
  Matrix of_newest(const Given& J) const;

 private:
  Matrix P_;
  Eigen::Index chaser_, before_;
};

}  // namespace tandem::detail
