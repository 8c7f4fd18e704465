#pragma once

#include <deque>
#include <vector>

#include <tandem/problem/navigation/imu_record.hpp>
#include <tandem/problem/problem.hpp>
#include <tandem/residuals/dvl_preintegrator.hpp>

namespace tandem {

/// One end of a factor.
struct DvlKeyframe {
  double t;  ///< s
  Variable<SE3> pose;
  Vector<3> gyroscope_bias;  ///< rad/s, along the sensor's axes, taken off the samples after it
};

/// A Doppler log's readings, summed up between keyframes (PreintegratedDvl). A reading holds until the next one, for a
/// greatest age at most; where none holds, keyframes have no factor between them. Readings may come late: those factors
/// are made anew that they change, and so is the one before, once it is known how long its last reading holds, since a
/// reading which two factors share is divided between them by time (see DvlPreintegrator).
class DvlFactors {
 public:
  /// `greatest_age` [s] of a reading that still counts. `loss`: of sensors that have none of their own.
  DvlFactors(double greatest_age, const Loss& loss) : greatest_age_(greatest_age), loss_(loss) {}

  struct Reading {
    double t;            ///< s, when it was valid
    Vector<3> velocity;  ///< m/s
    std::size_t sensor;
  };
  /// What factors are made with. `sensors`: by the readings' indices.
  struct Into {
    Problem& problem;
    const ImuRecord& imu;
    const std::vector<EgoSensor>& sensors;
  };

  /// In any order.
  void add(const Reading& reading, const Into& into);
  /// Two keyframes that inertial samples tie, later than those before them.
  void tie(const DvlKeyframe& from, const DvlKeyframe& to, const Into& into);
  /// Forgets factors from before t, whose variables have left the problem, and what only they need.
  void drop_before(double t);

 private:
  struct Factor {
    DvlKeyframe from, to;
    std::optional<Block> block{};
  };

  std::size_t holding_at(double t) const;
  double end_of(std::size_t reading) const;
  DvlReading as_held(std::size_t reading, const Into& into) const;
  bool covered(double from, double to) const;
  void make_between(double from, double to, const Into& into);
  void make(Factor& factor, const Into& into) const;

  double greatest_age_;
  Loss loss_;
  std::deque<Reading> readings_;  // in time order
  std::deque<Factor> factors_;    // in time order
};

}  // namespace tandem
