#pragma once

#include <string>

#include <tandem/studies/estimation/estimate_metrics.hpp>
#include <tandem/studies/support/json_fields.hpp>

namespace tandem {

/// Adds KEY_mean_UNIT and KEY_std_UNIT. `get(value)` returns an optional MeanStd; if it is empty, both are omitted.
template <class T, class F>
void add_mean_std(JsonFields<T>& fields, const std::string& key, const std::string& unit, const std::string& what,
                  F get) {
  fields.add(key + "_mean_" + unit, "mean " + what, [get](const T& value) -> std::optional<double> {
    const std::optional<MeanStd> errors = get(value);
    return errors ? std::optional(errors->mean) : std::nullopt;
  });
  fields.add(key + "_std_" + unit, "standard deviation of the " + what, [get](const T& value) -> std::optional<double> {
    const std::optional<MeanStd> errors = get(value);
    return errors ? std::optional(errors->std) : std::nullopt;
  });
}

/// Returns the keys of the errors of the target relative to the chaser at a set of keyframes.
inline JsonFields<ErrorSummary> error_fields() {
  using E = ErrorSummary;
  JsonFields<E> fields;
  fields.add("n", "number of keyframes", [](const E& e) { return e.n; })
      .add("n_with_truth", "number of keyframes that the truth covers, if it covers only some",
           [](const E& e) -> std::optional<int> {
             return e.compared > 0 && e.compared < e.n ? std::optional(e.compared) : std::nullopt;
           });
  add_mean_std(fields, "position", "m", "position error [m]", [](const E& e) { return e.position; });
  add_mean_std(fields, "orientation", "deg", "orientation error [deg]", [](const E& e) { return e.orientation; });
  add_mean_std(fields, "raw_position", "m", "position error of the measurements themselves [m]",
               [](const E& e) { return e.raw_position; });
  add_mean_std(fields, "raw_orientation", "deg", "orientation error of the measurements themselves [deg]",
               [](const E& e) { return e.raw_orientation; });
  return fields;
}

}  // namespace tandem
