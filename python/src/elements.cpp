#include "elements.hpp"

namespace tandem::python {

std::vector<const Group*>& groups() {
  static std::vector<const Group*> all;
  return all;
}

const Group* find_group(const std::type_info& type) {
  for (const Group* group : groups())
    if (*group->type == type) return group;
  return nullptr;
}

const Group* group_of(py::handle value) {
  for (const Group* group : groups())
    if (group->holds(value)) return group;
  return nullptr;
}

}  // namespace tandem::python
