#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include <tandem/problem/problem.hpp>

namespace tandem {

/// Rows of a block in a noise group: `count` rows from `first` on, or all following rows if count is negative.
struct NoiseRows {
  Block block;
  int first = 0, count = -1;
  int problem = 0;  ///< index of its problem among those that are calibrated together
  /// Fraction of a measurement that each row counts for, in (0, 1]. Below 1 if several blocks share one measurement.
  double share = 1;
};

/// Residual rows whose standard deviations share one unknown factor, e.g. one axis of a sensor, or one component of a
/// motion prior, at all times.
struct NoiseGroup {
  std::string name;
  std::vector<NoiseRows> rows;
  /// Standard deviation of the log factor before the data are seen; 0: no prior. With the default, a factor of 20 or
  /// 1/20 is three standard deviations away.
  double prior = 1.0;
};

namespace detail {

/// Returns the problem with this index. Throws BadInputError if there is none.
inline Problem& problem_at(std::span<Problem* const> problems, int index) {
  if (std::size_t(index) >= problems.size())
    throw BadInputError("calibrate: a block refers to problem " + std::to_string(index) +
                        ", which does not exist; indices are from 0 to " + std::to_string(problems.size()) + " - 1");
  return *problems[std::size_t(index)];
}

inline std::vector<std::shared_ptr<Problem>> copies_of(std::span<Problem* const> problems) {
  std::vector<std::shared_ptr<Problem>> copies;
  for (const Problem* problem : problems) copies.push_back(std::make_shared<Problem>(problem->copy()));
  return copies;
}

inline std::vector<Problem*> pointers_to(const std::vector<std::shared_ptr<Problem>>& problems) {
  std::vector<Problem*> pointers;
  for (const auto& problem : problems) pointers.push_back(problem.get());
  return pointers;
}

}  // namespace detail

}  // namespace tandem
