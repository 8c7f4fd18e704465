#pragma once

#include <functional>
#include <string>
#include <vector>

#include "recording.hpp"

namespace tandem::faults {

/// Where a fault is put, and on which of a recording's streams.
struct Site {
  double from;         ///< s
  std::string motion;  ///< the chaser's
  std::string sensor;  ///< of the others, the one that tells most of what the errors are of
};

/// What may go wrong with a feed in the field.
struct Fault {
  std::string name;
  /// Puts it into the lines; returns until when it lasts [s].
  std::function<double(std::vector<Line>&, const Site&)> inject;
  std::string said{};          ///< part of what has to be told of it: a notice, a complaint or why a line was refused
  bool odometry_only = false;  ///< it is about a stream of poses
};

const std::vector<Fault>& all_faults();

}  // namespace tandem::faults
