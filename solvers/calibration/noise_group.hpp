#pragma once

#include <string>
#include <vector>

#include <tandem/problem/problem.hpp>

namespace tandem {

/// Rows of a block that a noise group scales: `count` of them from `first` on; all that follow where count is negative.
struct NoiseRows {
  Block block;
  int first = 0, count = -1;
  int problem = 0;  ///< of the problems that are calibrated together, the one whose block it is
  double share =
      1;  ///< of a datum, that each of these rows is, where several say one thing at a share of its information
};

/// Rows whose standard deviations are known up to one factor that they share: those of a sensor along one axis, or of a
/// motion prior's component, at all times.
struct NoiseGroup {
  std::string name;
  std::vector<NoiseRows> rows;
  /// Standard deviation of the factor's logarithm around that of the noise as it was given, before the data are seen: by
  /// default a factor of 20 either way is as likely as not three sigmas off. 0: no prior.
  double prior = 1.0;
};

}  // namespace tandem
