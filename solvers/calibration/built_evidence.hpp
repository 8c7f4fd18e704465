#pragma once

#include <optional>
#include <string>
#include <vector>

#include <tandem/solvers/calibration/calibrate_built.hpp>
#include <tandem/solvers/calibration/evidence.hpp>

namespace tandem::detail {

/// The evidence of problems that are built from parameters, as a function of x, the log factors on the given
/// parameters. See calibrate_built().
class BuiltEvidence {
 public:
  using Problems = std::vector<std::shared_ptr<Problem>>;

  BuiltEvidence(const BuildProblems& build, const std::vector<BuiltParameter>& parameters,
                const CalibrationOptions& options);

  /// The profile evidence at some parameters: the maximum over the noise factors.
  struct Point {
    bool usable = false;
    double value = -HUGE_VAL;  ///< log evidence, with the priors
    Eigen::VectorXd factors;   ///< log factors of the noise groups; 0 if fixed
    Problems solved{};         ///< copies of the problems
  };
  /// Calibrates the noise at the given parameters and returns the point. Sets `found` to the calibration, and
  /// `as_given` to the evidence with the given noise. With CalibrationOptions::ranges, unidentifiable groups are fixed
  /// from now on. Throws Error if that fails.
  Point first(Calibration& found, double& as_given);
  /// Returns the point at x, starting from the noise factors and the states of `from`.
  Point profile(const Eigen::VectorXd& x, const Point& from);
  /// Returns the first and second derivative by x[i] at a point, with fixed noise factors. One-sided near a bound.
  std::pair<double, double> derivatives(const Eigen::VectorXd& x, const Point& point, Eigen::Index i);
  /// Calibrates the noise at x with standard errors. Sets `value` to the log evidence.
  Calibration noise(const Eigen::VectorXd& x, const Point& at, double& value);

  const Eigen::VectorXd& low() const { return low_; }    ///< lower bounds of x
  const Eigen::VectorXd& high() const { return high_; }  ///< upper bounds of x
  /// Returns the parameters at x.
  Eigen::VectorXd values(const Eigen::VectorXd& x) const;
  bool has_noise() const { return !free_noise_.empty(); }
  const std::string& why() const { return why_; }  ///< the reason of the last point that is not usable
  int builds() const { return builds_; }
  int solves() const { return solves_; }

 private:
  struct Built {
    BuiltProblems of;
    std::vector<Problem*> raw;
    double constants = 0;  // log_constants()
  };
  Built make(const Eigen::VectorXd& x, const Point* from);
  std::optional<Built> try_make(const Eigen::VectorXd& x, const Point& from);
  CalibrationOptions inner(const Built& built) const;
  double priors(const Eigen::VectorXd& x) const;
  Calibration calibrate(const Built& built, const std::vector<NoiseGroup>& groups, const CalibrationOptions& options);
  Evidence::Value evidence(const Built& built, const Eigen::VectorXd& factors, Problems* solved = nullptr);
  Point profile_of(const Built& built, const Eigen::VectorXd& factors);
  double at(const Eigen::VectorXd& x, const Point& point);

  const BuildProblems& build_;
  const std::vector<BuiltParameter>& parameters_;
  const CalibrationOptions& options_;
  Eigen::VectorXd given_, low_, high_;
  std::vector<bool> free_noise_;  // per noise group: it is calibrated
  Eigen::VectorXd counted_;       // Calibration::counted_rows
  int builds_ = 0, solves_ = 0;
  std::string why_;
};

}  // namespace tandem::detail
