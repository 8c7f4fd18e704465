#pragma once

#include <deque>
#include <vector>

#include <tandem/problem/navigation/imu_record.hpp>
#include <tandem/problem/problem.hpp>
#include <tandem/residuals/dvl_preintegrator.hpp>

namespace tandem {

/// A keyframe at one end of a factor.
struct DvlKeyframe {
  double t;  ///< s
  Variable<SE3> pose;
  Vector<3> gyroscope_bias;  ///< rad/s, along the sensor's axes; subtracted from the samples after the keyframe
};

/// Factors that preintegrate DVL velocities between consecutive keyframes (PreintegratedDvl).
///
/// A reading holds until the next one, for max_age at most. Two keyframes get a factor only if readings cover the whole
/// interval between them. Readings may be added in any order: a late reading rebuilds the factors that it changes. This
/// includes the preceding factor if both share a reading, because a shared reading is split by time (DvlPreintegrator).
class DvlFactors {
 public:
  /// `max_age` is the maximum time that a reading holds [s]. `loss` applies to sensors without their own loss.
  DvlFactors(double max_age, const Loss& loss) : max_age_(max_age), loss_(loss) {}

  struct Reading {
    double t;            ///< time of validity [s]
    Vector<3> velocity;  ///< over ground, along body axes [m/s]
    std::size_t sensor;  ///< index in Context::sensors
  };
  /// Objects that are needed to build factors.
  struct Context {
    Problem& problem;
    const ImuRecord& imu;
    const std::vector<EgoSensor>& sensors;
  };

  /// Adds a reading and rebuilds the factors that it changes.
  void add(const Reading& reading, const Context& context);
  /// Adds a factor between two keyframes. IMU samples must cover the interval, and it must follow all earlier factors.
  void connect(const DvlKeyframe& from, const DvlKeyframe& to, const Context& context);
  /// Forgets factors that start before t, and readings that only they need. Does not remove blocks from the problem:
  /// these must have left it with their variables.
  void drop_before(double t);

 private:
  struct Factor {
    DvlKeyframe from, to;
    std::optional<Block> block{};
  };

  std::size_t reading_at(double t) const;
  double end_of(std::size_t reading) const;
  DvlReading preintegrator_input(std::size_t reading, const Context& context) const;
  bool covers(double from, double to) const;
  void rebuild_between(double from, double to, const Context& context);
  void rebuild(Factor& factor, const Context& context) const;

  double max_age_;
  Loss loss_;
  std::deque<Reading> readings_;  // in time order
  std::deque<Factor> factors_;    // in time order
};

}  // namespace tandem
