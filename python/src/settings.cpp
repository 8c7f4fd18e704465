#include "settings.hpp"

#include <optional>
#include <string>

#include <yaml-cpp/yaml.h>

namespace tandem::python {
namespace {

py::object scalar(const YAML::Node& node) {
  const std::string text = node.Scalar();
  if (node.Tag() == "!") return py::str(text);  // quoted
  long long whole;
  double number;
  if (YAML::convert<long long>::decode(node, whole)) return py::int_(whole);
  if (YAML::convert<double>::decode(node, number)) return py::float_(number);
  if (text == "true" || text == "false") return py::bool_(text == "true");
  return py::str(text);
}

py::object converted(const YAML::Node& node) {
  if (node.IsScalar()) return scalar(node);
  if (node.IsSequence()) {
    py::list list;
    for (const YAML::Node& item : node) list.append(converted(item));
    return list;
  }
  if (node.IsMap()) {
    py::dict dict;
    for (const auto& entry : node) dict[py::str(entry.first.Scalar())] = converted(entry.second);
    return dict;
  }
  return py::none();
}

}  // namespace

void bind_settings(py::module_& m) {
  m.def(
      "parse_yaml",
      [](const std::string& text, const std::string& name) {
        try {
          return converted(YAML::Load(text));
        } catch (const YAML::Exception& error) {
          throw py::value_error(name + ":" + std::to_string(error.mark.line + 1) + ": " + error.msg);
        }
      },
      py::arg("text"), py::arg("name"), "Return the content of a YAML text as dictionaries, lists and scalars.");
}

}  // namespace tandem::python
