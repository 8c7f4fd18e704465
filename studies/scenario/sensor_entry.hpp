#pragma once

#include <optional>
#include <string>

#include <tandem/lie/sek3.hpp>
#include <tandem/problem/navigation/staying_error.hpp>
#include <tandem/residuals/loss.hpp>
#include <tandem/studies/scenario/frame.hpp>
#include <tandem/studies/scenario/yaml_section.hpp>

namespace tandem {

/// What the entries of all sensors share, be they of the target or of the chaser itself. Each throws Error naming file,
/// line and reason.

/// A sensor in a body, out of the keys `position` and `orientation`, both optional, with a prefix before each.
SE3 read_extrinsics(const YamlSection& sensor, const Frame& frame, const std::string& prefix = "");
/// Seconds, zero where none is given; below zero, stamps being early, where that may be.
double read_delay(const YamlSection& sensor, bool may_be_early = false);
/// Out of the key `error`: {sigma: […], time: 20, scale: 0.01, misalignment: 0.02, delay: 0.1}, a bias of so many rows,
/// constant without a time, and the standard deviations of constants; one or more of them.
std::optional<StayingError> read_error(const YamlSection& sensor, int rows);
std::optional<Loss> read_loss(const YamlSection& sensor, const std::string& key);

}  // namespace tandem
