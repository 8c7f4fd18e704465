#pragma once

#include <map>
#include <span>
#include <string>
#include <tuple>
#include <vector>

#include <tandem/solvers/marginals.hpp>
#include <tandem/solvers/residual_series.hpp>

namespace tandem {

/// A sensor whose measurements fit_report() judges.
struct JudgedSensor {
  std::string name;
  std::vector<std::string> components;  ///< names of its residual rows, for example "x", "y", "z"
  std::vector<double>
      rejected{};  ///< stamps [s] of measurements that are not in the problem: they contradict the others
};

/// A measurement in a problem, or a part of one that has a separate block. The part with component 0 comes first.
struct MeasurementBlock {
  std::size_t sensor;  ///< index among the sensors
  double t;            ///< time stamp [s]
  Block block;         ///< a soft block
  int first = 0;       ///< component of the block's first row
};

/// A soft block that is no measurement, such as a motion prior, and the name of its noise.
struct NoiseOfBlock {
  std::string noise;
  Block block;
};

/// Fit of the blocks with one noise, such as that of the motion prior.
struct NoiseFit {
  std::string name;
  /// Root mean square of each row's residuals in expected standard deviations; 1 if the noise is as stated. Without the
  /// rows that the states absorb.
  std::vector<double> rms;
};

/// Fit of one sensor's measurements.
struct SensorFit {
  std::string name;
  int used = 0;                       ///< measurements in the problem
  int rejected = 0;                   ///< number of JudgedSensor::rejected
  int down_weighted = 0;              ///< of `used`: the robust loss leaves a weight ρ′ below kDownweightThreshold
  double expected_down_weighted = 0;  ///< the same, if the noise is as stated
  /// Root mean square of the normalised innovations of an online estimator; 0 for a solved problem, which has `series`.
  double innovation_rms = 0;
  std::vector<std::string> components;
  std::vector<ResidualSeries> series;                ///< by component; without the down-weighted measurements
  std::vector<ResidualMoments> moments;              ///< by component; of an online estimator, which keeps no series
  std::vector<ResidualSeries> down_weighted_series;  ///< by component; the down-weighted measurements only
  std::vector<double> rejected_at;                   ///< JudgedSensor::rejected [s]
  std::string likely_mistake;           ///< in the data, whose correction lowers the cost; set by the caller
  std::vector<WorstMeasurement> worst;  ///< at most five, the largest residual first; down-weighted ones included

  /// Returns the component with the largest root mean square.
  std::size_t worst_component() const;
  /// Returns the share of measurements that are rejected, or down-weighted beyond expectation.
  double contested() const;
  /// Returns the misfits in words, for example "ry is 38 times its standard deviation", or an empty string if the
  /// residuals agree with the stated noise. The rules: the root mean square of a component is above 2, a tenth of the
  /// measurements is contested, or there is a likely mistake.
  std::string misfit() const;
};

/// Agreement of a solution with its data and the stated noise. Convergence of a solver does not imply this agreement.
struct FitReport {
  double cost = 0;            ///< cost F of the problem
  double expected_cost = 0;   ///< E[F] if all noises are as stated
  double cost_sigma = 0;      ///< standard deviation of F in that case
  bool by_marginals = false;  ///< whether residuals are standardised by their own variances
  std::vector<SensorFit> sensors;
  std::vector<NoiseFit> noises;  ///< in the order of their first blocks

  /// Returns whether the stated noise is so large that costs, standard deviations and this report are not informative:
  /// the cost is below a quarter of its expectation.
  bool noise_is_far_too_large() const;
  /// Returns whether there are more residuals than unknowns; otherwise the cost says nothing about the fit.
  bool is_redundant() const { return expected_cost > 0; }
  /// Returns whether no sensor has a misfit and the cost, if it can be judged, is at most five standard deviations or
  /// half above its expectation.
  bool consistent() const;
  /// Returns the noises of sensors and other blocks whose residuals are at most half as large as stated, with the
  /// factors by which they are too large, or an empty string. Needs marginals: otherwise it is unknown whose residuals
  /// the states absorb.
  std::string oversized_noises() const;
  /// Returns the verdict in one sentence for each misfit, or one sentence that states the agreement.
  std::string verdict() const;
};

/// A robust weight ρ′ below this value counts as down-weighted.
inline constexpr double kDownweightThreshold = 0.5;

/// Judges the values of a solved problem.
///
/// Without losses, twice the cost is χ² distributed with as many degrees of freedom as rows minus free unknowns; hard
/// equalities and active bounds reduce the unknowns. With a robust loss, each row counts with the expectation of the
/// loss under the stated noise. Rows without derivative, such as inactive soft bounds, do not count. Residuals are
/// standardised by their noise minus the part that the states absorb, R − H P Hᵀ. This needs `marginals` of the
/// problem; without them, the noise is reduced by the average share. `noises` are the blocks of FitReport::noises.
/// Throws Error if a handle is invalid.
FitReport fit_report(const Problem& problem, const std::vector<JudgedSensor>& sensors,
                     std::span<const MeasurementBlock> measurements, const Marginals* marginals = nullptr,
                     std::span<const NoiseOfBlock> noises = {});

namespace detail {

/// Expectations for a block with `rows` rows whose noise is as stated.
struct LossExpectation {
  double half_rho;       ///< E[½ ρ(s)], s ~ χ² with `rows` degrees of freedom
  double down_weighted;  ///< probability that ρ′(s) < kDownweightThreshold
};
LossExpectation loss_expectation(const Loss& loss, int rows);

/// Keeps the expectations for all combinations of loss and rows that occur. Few do.
class LossExpectations {
 public:
  const LossExpectation& operator()(const Loss& loss, int rows);

 private:
  std::map<std::tuple<Loss::Kind, double, int>, LossExpectation> known_;
};

}  // namespace detail
}  // namespace tandem
