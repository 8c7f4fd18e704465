#pragma once

#include <optional>

#include <tandem/problem/navigation/navigation_checks.hpp>

namespace tandem {

/// The parts of check() that ask whether sensors measure what they should, of data whose times increase. They throw
/// Error where they do not.

/// Specific force: its magnitude that of gravity, and upwards.
std::optional<NavigationFinding> check_specific_force(const NavigationData& data);
/// Angular rate: in radians and, where there is a heading sensor, about its axes.
void check_angular_rate(const NavigationData& data);
/// Magnitudes of the other sensors.
std::optional<NavigationFinding> check_magnitude(const EgoSensor& sensor);

/// "%g" of a number, for messages.
std::string short_number(double value);

}  // namespace tandem
