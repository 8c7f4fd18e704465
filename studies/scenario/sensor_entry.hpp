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
/// Seconds, zero where none is given.
double read_delay(const YamlSection& sensor);
/// Of so many rows, out of the key `error`: {sigma: […], time: 20}; without a time it is constant.
std::optional<StayingError> read_error(const YamlSection& sensor, int rows);
std::optional<Loss> read_loss(const YamlSection& sensor, const std::string& key);

}  // namespace tandem
