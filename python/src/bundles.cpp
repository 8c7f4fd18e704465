#include <tandem/lie/error.hpp>

#include "bind_bundle.hpp"

namespace tandem::python {

std::vector<MakeBundle>& bundles() {
  static std::vector<MakeBundle> all;
  return all;
}

void bind_bundles(py::module_& m) {
  bind_bundle<SE3, R3>(m);
  bind_bundle<SE3, Rn<6>>(m);
  bind_bundle<SE3, SE3>(m);
  bind_bundle<SE2, R3>(m);
  m.def(
      "Bundle",
      [](const py::args& parts) -> py::object {
        for (const MakeBundle make : bundles())
          if (const py::object bundle = make(parts)) return bundle;
        std::string given, known;
        for (const py::handle part : parts) {
          const Group* const group = group_of(part);
          const std::string name = group ? group->name : std::string(py::str(py::type::of(part).attr("__name__")));
          given += (given.empty() ? "" : ", ") + name;
        }
        for (const Group* group : groups())
          if (group->name.starts_with("Bundle")) {
            std::string names = group->name.substr(7);
            std::replace(names.begin(), names.end(), '_', ' ');
            known += (known.empty() ? "" : "; ") + names;
          }
        throw BadInputError("Bundle: the products are " + known + ", not (" + given + ")");
      },
      "Bundle(*parts)\n\nReturn the product of group elements or arrays of them: (SE3, R3), (SE3, R6), (SE3, SE3) or "
      "(SE2, R3). It has the functions of all groups; tangents are stacked in the order of the parts, and the property "
      "`parts` returns them.\n\n"
      ">>> import tandem\n>>> X = tandem.Bundle(tandem.SE3(), tandem.R3([1, 2, 3]))\n>>> X.log().shape\n(9,)\n"
      ">>> (X @ X).parts[1]\nR3(2, 4, 6)\n");
}

}  // namespace tandem::python
