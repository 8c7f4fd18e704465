#include "options.hpp"

namespace tandem::python {

py::object Options::find(const char* name) {
  known_ += (known_.empty() ? "" : ", ") + std::string(name);
  if (!given_.contains(name)) return {};
  ++used_;
  return given_[name];
}

void Options::operator()(const char* name, std::map<std::string, std::string>& value) {
  const py::object given = find(name);
  if (!given) return;
  if (!py::isinstance<py::dict>(given)) throw_wrong(name, given);
  for (const auto& [key, of_key] : py::reinterpret_borrow<py::dict>(given)) value[py::str(key)] = py::str(of_key);
}

void Options::throw_wrong(const char* name, const py::object& given) const {
  throw py::type_error(owner_ + ": option " + name + " has the wrong type: " + std::string(py::repr(given)));
}

void Options::finish() const {
  if (used_ == py::len(given_)) return;
  for (const auto& [key, value] : given_)
    if ((", " + known_ + ",").find(", " + key.cast<std::string>() + ",") == std::string::npos)
      throw py::type_error(owner_ + ": unknown option " + key.cast<std::string>() + "; the options are " + known_);
}

}  // namespace tandem::python
