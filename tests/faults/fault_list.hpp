#pragma once

#include <functional>
#include <string>
#include <vector>

#include "recording.hpp"

namespace tandem::faults {

/// The place of a fault in a recording.
struct Site {
  double from;         ///< time [s]
  std::string motion;  ///< stream of the chaser's motion
  std::string sensor;  ///< the sensor that affects the errors most
};

/// A fault of a live feed that may occur in the field.
struct Fault {
  std::string name;
  /// Injects the fault into the lines. Returns the time at which it ends [s].
  std::function<double(std::vector<Line>&, const Site&)> inject;
  std::string expected_message{};  ///< part of an expected notice, warning or rejection reason
  bool odometry_only = false;      ///< applies only to odometry
};

/// Returns all faults of live feeds.
const std::vector<Fault>& all_faults();

}  // namespace tandem::faults
