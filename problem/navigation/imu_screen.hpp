#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include <tandem/problem/navigation/navigation_data.hpp>

namespace tandem {

/// Reasons why the samples of an IMU are not physical.
enum class ImuFault {
  missing,       ///< not finite, or a marker of missing data
  out_of_range,  ///< far beyond the range of the sensor
  no_gravity,    ///< almost no specific force
  frozen,        ///< all axes repeat their values
  spike,         ///< far from the samples before
};
inline constexpr int kImuFaults = 5;

/// Completes a sentence about samples, e.g. "10 samples": "without gravity".
std::string_view text(ImuFault fault);

/// Returns the faults that only later samples show: single samples far from both neighbours, compared with the typical
/// step between samples, and equal samples at the start of a recording that changes later.
std::vector<std::optional<ImuFault>> faults_beside_neighbours(const std::vector<ImuSample>& samples);

/// Judges the samples of an IMU one by one, in time order. Batch estimation and online estimation use the same rules.
/// Samples that are not physical leave a gap (ImuSample::gap). A lasting change of the level, such as a new mounting,
/// is accepted after half a second.
class ImuScreen {
 public:
  explicit ImuScreen(const ImuSensor& sensor);

  /// Returns why the next sample is not physical; `known` is a fault found otherwise. If it is, sets its `gap` and
  /// returns nothing.
  std::optional<ImuFault> judge(ImuSample& sample, std::optional<ImuFault> known = {});

 private:
  /// Level of one triad, and the typical deviation from it.
  struct Level {
    Vector<3> mean = Vector<3>::Zero();
    double deviation = 0;
    double limit;  // deviation that is accepted at any time

    bool is_far(const Vector<3>& value) const { return (value - mean).norm() > limit + kDeviations * deviation; }
    void add(const Vector<3>& value, double weight, double slow_weight);
    static constexpr double kDeviations = 10;
  };
  std::optional<ImuFault> fault(const ImuSample& sample);
  bool lacks_gravity(const ImuSample& sample) const;
  bool is_saturated(const ImuSample& sample) const;
  bool is_frozen(const ImuSample& sample);
  bool is_spike(const ImuSample& sample);
  void learn(const ImuSample& sample);

  double max_force_, max_rate_;              // m/s², rad/s
  double saturated_force_, saturated_rate_;  // declared limits, or infinity
  Level force_, rate_;
  std::optional<ImuSample> last_, last_used_;
  double run_begin_ = 0;                          // time of the first of the equal samples up to last_ [s]
  std::size_t samples_ = 0, runs_ = 0, run_ = 0;  // samples seen; runs of equal samples, and length of the newest
  std::size_t used_ = 0, spikes_ = 0;             // samples used; successive spikes
  double first_spike_ = 0;                        // time of the first of the successive spikes [s]
  bool gap_ = false;                              // samples since last_used_ were discarded
};

}  // namespace tandem
