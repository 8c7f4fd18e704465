#pragma once

#include <string>
#include <utility>
#include <vector>

#include <tandem/problem/navigation/navigation_checks.hpp>
#include <tandem/problem/navigation/navigation_problem.hpp>

namespace tandem {

/// The measurements of a recording that contradict the others by far, and therefore do not count. The online first pass
/// suggests them; the residuals of each batch solution confirm them, clear them, or find more. A sensor whose residuals
/// are all larger than its stated noise has a wrong noise, not gross errors.
class GrossErrors {
 public:
  /// `suggested`: standard deviations from which suggest() counts.
  explicit GrossErrors(const NavigationData& data, double suggested = 20);

  /// Suggests the measurement of a sensor that is valid at t [s], with its normalised innovation.
  void suggest(const std::string& sensor, double t, double sigmas);
  /// Discards the suggestions for sensors of which more than a third of the measurements are suggested.
  void keep_rare();

  /// Takes the rejected measurements out of the problem, except for residuals without influence.
  void apply(NavigationProblem& built) const;
  /// Judges all measurements by their residuals at the solution. Returns whether the problem must be solved again.
  bool revise(const NavigationProblem& built);
  /// Returns how many measurements of each sensor are rejected, with times of validity in one of these intervals [s].
  std::vector<std::size_t> rejected_in(const std::vector<std::pair<double, double>>& intervals) const;
  /// Removes the rejected measurements from a solved problem and from the data, and reports them. Returns the time
  /// stamps [s] of the removed measurements, by sensor.
  std::vector<std::vector<double>> remove(NavigationProblem& built, NavigationData& data,
                                          std::vector<NavigationFinding>& findings) const;

 private:
  struct Verdict {
    bool rejected = false, cleared = false;
    double sigmas = 0;
  };
  Verdict& of(const PlacedEgoMeasurement& m) { return verdicts_[m.sensor][m.index]; }
  const Verdict& of(const PlacedEgoMeasurement& m) const { return verdicts_[m.sensor][m.index]; }

  const NavigationData& data_;
  double suggested_;
  std::vector<std::vector<Verdict>> verdicts_;  // by sensor and measurement
  int revisions_ = 0;
};

}  // namespace tandem
