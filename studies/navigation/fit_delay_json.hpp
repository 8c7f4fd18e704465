#pragma once

#include <tandem/studies/navigation/fit_delay.hpp>
#include <tandem/studies/support/json_fields.hpp>

namespace tandem {

/// Returns the fields of a fitted delay in the JSON documents of `estimate` and `navigate`.
inline JsonFields<DelayFit> delay_fields() {
  using D = DelayFit;
  return JsonFields<D>()
      .add("seconds", "fitted delay [s]", [](const D& d) { return d.delay; })
      .add("cost", "cost with the fitted delay", [](const D& d) { return d.cost; })
      .add("cost_as_given", "cost with the given delay", [](const D& d) { return d.cost_before; })
      .add("sigma", "standard deviation of the delay [s]", [](const D& d) { return d.sigma; });
}

}  // namespace tandem
