#pragma once

#include <optional>
#include <string>
#include <string_view>

#include <tandem/lie/sek3.hpp>

namespace tandem {

/// Numbers of decimals in a trajectory file.
struct TumDecimals {
  int time, position, quaternion;
};

/// The header line of a trajectory in the TUM format.
inline constexpr const char* tum_header = "# t[s] x[m] y[m] z[m] qx qy qz qw\n";

/// The comment line before a pose without an orientation, whose quaternion is the identity: the format needs a valid
/// quaternion in each row.
inline constexpr std::string_view tum_no_orientation = "# no orientation";

/// Returns a line of a TUM file: t [s], position [m] and quaternion (x y z w). Without an orientation, the comment
/// tum_no_orientation precedes it. Without `decimals`, numbers have the fewest digits that read back to the same value.
std::string tum_row(double t, const Vector<3>& position, const std::optional<SO3>& orientation,
                    const std::optional<TumDecimals>& decimals = {});
std::string tum_row(double t, const SE3& pose, const std::optional<TumDecimals>& decimals = {});

}  // namespace tandem
