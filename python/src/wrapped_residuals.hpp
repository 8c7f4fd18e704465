#pragma once

#include "residual_family.hpp"

namespace tandem::python {

/// Declares the wrapper W of an existing family, for example Interpolated<Range<…>> as "Interpolated.Range". Its members
/// are those of the family, then `extras`.
template <template <class> class W, Residual... Rs>
void declare_wrapped(const std::string& wrapper, const std::string& inner, const std::vector<std::string>& extras) {
  const Family& of = families().at(inner);
  Family& family = families()[wrapper + "." + inner];
  family = {wrapper + "." + inner, of.members, of.required, {}};
  family.members.insert(family.members.end(), extras.begin(), extras.end());
  (add_instance<W<Rs>>(family), ...);
}

void bind_wrapped_residuals(py::module_& m);

}  // namespace tandem::python
