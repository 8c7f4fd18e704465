#pragma once

#include <optional>
#include <string>

#include <tandem/lie/sek3.hpp>

namespace tandem {

/// Decimals of a trajectory file; none: every number to its last digit.
struct TumDecimals {
  int time, position, quaternion;
};

/// The first line of a trajectory in the TUM format.
inline constexpr const char* tum_header = "# t[s] x[m] y[m] z[m] qx qy qz qw\n";

/// A line of it: t [s], position [m] and quaternion, x y z w, as nan where there is no orientation.
std::string tum_row(double t, const Vector<3>& position, const std::optional<SO3>& orientation,
                    const std::optional<TumDecimals>& decimals = {});
std::string tum_row(double t, const SE3& pose, const std::optional<TumDecimals>& decimals = {});

}  // namespace tandem
