#pragma once

#include <Eigen/Core>

namespace tandem::detail {

/// The joint covariance, of at most 24 unknowns, of [the chaser's newest pose; the target before; the target now], as the
/// target goes on and the chaser's does not.
class CarriedCovariance {
 public:
  using Vector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 24, 1>;
  using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, 24, 24>;
  using Given = Eigen::Ref<const Eigen::MatrixXd>;
  using GivenVector = Eigen::Ref<const Eigen::VectorXd>;

  /// The first `chaser` unknowns are the chaser's, the next `before` the target's before.
  CarriedCovariance(const Given& covariance, int chaser, int before);

  /// What comes now is `by` times the target's unknowns, and noise; the first of what was now are before. False where
  /// nothing but rounding would be left of a variance of the first `positions` of what comes.
  bool carry(const Given& by, const Given& noise, int positions);
  /// The same with what comes given by next · it + by · the target's unknowns = noise.
  bool carry(const Given& next, const Given& by, const Given& noise, int positions);

  /// r, whose derivatives by the target's unknowns from the `first` on are J, is zero but for noise: the correction of all
  /// of the target's.
  Vector take_in(const GivenVector& r, int first, const Given& J, const GivenVector& sigma);

  /// Of the chaser, and of `by` times what is now.
  Matrix of_newest(const Given& by) const;

 private:
  Matrix P_;
  Eigen::Index chaser_, before_;
};

}  // namespace tandem::detail
