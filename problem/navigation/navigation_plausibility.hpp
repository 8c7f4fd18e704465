#pragma once

#include <optional>

#include <tandem/problem/navigation/navigation_checks.hpp>

namespace tandem {

// Plausibility checks that check() calls. They require increasing times, and throw Error for implausible readings.

/// Checks that the median specific force has the magnitude of gravity and points up.
std::optional<NavigationFinding> check_specific_force(const NavigationData& data);
/// Checks unit and sign of the angular rate against the specific force and the heading sensor, if there is one.
void check_angular_rate(const NavigationData& data);
/// Checks the magnitude of a sensor's readings against EgoSensorTraits::max_magnitude.
std::optional<NavigationFinding> check_magnitude(const EgoSensor& sensor);

/// Formats a number with six significant digits, for messages.
std::string short_number(double value);

}  // namespace tandem
