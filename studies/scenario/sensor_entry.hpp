#pragma once

#include <optional>
#include <string>
#include <vector>

#include <tandem/lie/sek3.hpp>
#include <tandem/problem/navigation/systematic_error.hpp>
#include <tandem/residuals/loss.hpp>
#include <tandem/studies/scenario/frame.hpp>
#include <tandem/studies/scenario/yaml_section.hpp>

namespace tandem {

/// Readers of the keys that all entries of `sensors:` share, those of target sensors and of the chaser's own sensors.
/// Each throws Error with file, line and reason.

/// Returns the pose of a sensor or marker in its body frame from the optional keys PREFIXposition and
/// PREFIXorientation.
SE3 read_extrinsics(const YamlSection& sensor, const Frame& frame, const std::string& prefix = "");
/// Returns the delay [s], 0 by default. A negative delay means that stamps are early; it needs `allow_negative`.
double read_delay(const YamlSection& sensor, bool allow_negative = false);
/// Returns the systematic errors in the key `error`, e.g. {sigma: […], time: 20, scale: 0.01, misalignment: 0.02,
/// delay: 0.1}. `sigma` has the standard deviations of a bias with `rows` components, and `time` its correlation time
/// [s] (without it, the bias is constant). The others are standard deviations of constants. At least one key is
/// required.
std::optional<SystematicError> read_error(const YamlSection& sensor, int rows);
/// Returns the numbers that stand for missing data, in the optional key `missing`, a number or a list of numbers.
std::vector<double> read_missing(const YamlSection& sensor);
/// Returns the robust loss in a key, e.g. "cauchy:2", or nothing if the key is missing.
std::optional<Loss> read_loss(const YamlSection& sensor, const std::string& key);

}  // namespace tandem
