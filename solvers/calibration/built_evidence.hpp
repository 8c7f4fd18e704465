#pragma once

#include <vector>

#include <tandem/solvers/calibration/calibrate_built.hpp>
#include <tandem/solvers/calibration/evidence.hpp>

namespace tandem::detail {

/// The evidence of problems that are built by parameters, as a function of the logarithms x of factors on what was given of these.
/// See calibrate_built().
class BuiltEvidence {
 public:
  BuiltEvidence(const BuildProblems& build, const std::vector<BuiltParameter>& parameters,
                const CalibrationOptions& options);

  /// The greatest evidence at some parameters, and the noise groups' factors there.
  struct Point {
    bool usable = false;
    double value = -HUGE_VAL;  ///< priors included
    Eigen::VectorXd factors;   ///< logarithms; 0 of what is held
    std::vector<std::shared_ptr<Problem>> solved{};
  };
  /// Noise as given at first, all groups free, or held where the data do not tell them if `ranges`; throws Error where that
  /// cannot be. What is told of each is in `found`; `as_given` is the evidence there.
  Point first(Calibration& found, double& as_given);
  /// From the factors and states of another.
  Point profile(const Eigen::VectorXd& x, const Point& from);
  /// First and second derivative along one parameter at a point, whose factors stay; from one side where a bound is near.
  std::pair<double, double> derivatives(const Eigen::VectorXd& x, const Point& point, Eigen::Index i);
  /// All that is to be told of the noise beside parameters at a point; the evidence there in `value`.
  Calibration noise(const Eigen::VectorXd& x, const Point& at, double& value);

  /// Limits of x.
  const Eigen::VectorXd& low() const { return low_; }
  const Eigen::VectorXd& high() const { return high_; }
  Eigen::VectorXd values(const Eigen::VectorXd& x) const;
  /// The prior's part in the evidence, of one.
  double prior(Eigen::Index i, double x) const;
  bool has_noise() const { return !free_noise_.empty(); }
  int builds() const { return builds_; }
  int solves() const { return solves_; }

 private:
  struct Built {
    BuiltProblems of;
    std::vector<Problem*> raw;
    double constants = 0;
  };
  Built make(const Eigen::VectorXd& x, const Point* from);
  CalibrationOptions inner(const Built& built) const;
  std::vector<Eigen::Index> free_groups() const;
  double priors(const Eigen::VectorXd& x) const;
  Calibration calibrate(const Built& built, const std::vector<NoiseGroup>& groups, const CalibrationOptions& options);
  Evidence::Value evidence(const Built& built, const Eigen::VectorXd& factors);
  Point profile_of(const Built& built, const Eigen::VectorXd& factors);
  double at(const Eigen::VectorXd& x, const Point& point);

  const BuildProblems& build_;
  const std::vector<BuiltParameter>& parameters_;
  const CalibrationOptions& options_;
  Eigen::VectorXd given_, low_, high_;
  std::vector<bool> free_noise_;  // of each group
  Eigen::VectorXd counted_;
  int builds_ = 0, solves_ = 0;
};

}  // namespace tandem::detail
