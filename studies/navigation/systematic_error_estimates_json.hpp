#pragma once

#include <vector>

#include <tandem/studies/navigation/systematic_error_estimates.hpp>
#include <tandem/studies/support/json_fields.hpp>

namespace tandem {

/// Returns the keys of one estimated systematic error.
inline JsonFields<SystematicErrorEstimate> systematic_error_fields() {
  using E = SystematicErrorEstimate;
  return JsonFields<E>()
      .add("value", "estimate, in the unit of the error", [](const E& e) { return e.value; })
      .add("sigma", "standard deviation of the estimate; 0 if unknown", [](const E& e) { return e.sigma; })
      .add("given_sigma", "standard deviation of its prior, whose mean is 0", [](const E& e) { return e.prior_sigma; })
      .add("verdict", "verdict as in the printed table", [](const E& e) { return text(e.verdict()); });
}

/// Returns pairs of names and estimates, for JsonFields::add_map().
inline std::vector<std::pair<std::string, SystematicErrorEstimate>> by_name(
    const std::vector<SystematicErrorEstimate>& found) {
  std::vector<std::pair<std::string, SystematicErrorEstimate>> pairs;
  for (const SystematicErrorEstimate& e : found) pairs.emplace_back(e.name, e);
  return pairs;
}

}  // namespace tandem
