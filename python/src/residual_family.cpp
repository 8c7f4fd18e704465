#include "residual_family.hpp"

#include <algorithm>
#include <cmath>

#include "evaluate.hpp"

namespace tandem::python {
namespace {

std::string group_names(const std::vector<const std::type_info*>& types) {
  std::string text;
  for (const std::type_info* type : types) {
    const Group* group = find_group(*type);
    text += (text.empty() ? "" : ", ") + (group ? group->name : type_name(*type));
  }
  return text;
}

/// Throws unless a value suits the member in one of the instances.
void check_member(const Family& family, std::size_t k, py::handle value) {
  const std::string& name = family.members[k];
  const std::string what = family.name + ": " + name;
  std::vector<std::pair<std::string, std::string>> wanted;  // a type or shapes, and the groups of states that need it
  std::string given, other;
  std::vector<const Instance*> instances;
  for (const Instance& instance : family.instances) instances.push_back(&instance);
  if (const Group* group = group_of(value))  // most likely that of the states; the others would throw
    std::stable_partition(instances.begin(), instances.end(),
                          [&](const Instance* i) { return *i->states[0] == *group->type; });
  for (const Instance* instance : instances) try {
      const Flat flat = instance->members[k].flatten(value, what);
      for (const double x : flat.numbers) {
        if (!std::isfinite(x)) throw py::value_error(what + ": must be finite");
        if (name == "range" && x < 0) throw py::value_error(what + ": a distance must not be negative");
        if (name.rfind("dt", 0) == 0 && x <= 0) throw py::value_error(what + ": a time step must be positive");
      }
      return;
    } catch (const py::value_error& error) {
      const std::string own = error.what();
      if (own.find("NaN") != std::string::npos || own.find("must") != std::string::npos) throw;
      const std::size_t from = own.find("expected "), to = own.rfind(", not ");
      if (from == std::string::npos || to == std::string::npos) {  // a value of the right type or shape
        if (other.empty()) other = own;
        continue;
      }
      const std::string want = own.substr(from + 9, to - from - 9);
      if (given.empty()) given = own.substr(to + 6);
      auto same = std::find_if(wanted.begin(), wanted.end(), [&](const auto& w) { return w.first == want; });
      if (same == wanted.end()) same = wanted.emplace(same, want, "");
      const std::string group = group_names({instance->states[0]});
      if ((" " + same->second + ",").find(" " + group + ",") == std::string::npos)
        same->second += (same->second.empty() ? "" : ", ") + group;
    }
  if (!other.empty()) throw py::value_error(other);
  std::string text;
  const bool many = wanted.size() > 4;  // a residual of all groups: the names of the groups suffice
  for (const auto& [want, groups] : wanted)
    text += (text.empty() ? ""
             : many       ? ", "
                          : ", or ") +
            (many ? groups : want + (wanted.size() > 1 ? " for states " + groups : ""));
  throw py::value_error(what + ": expected " + (many ? "a value of " : "") + text + ", not " + given);
}

/// Fills the members from positional and keyword arguments.
FamilyResidual make_residual(const Family& family, const py::args& args, const py::kwargs& kwargs) {
  FamilyResidual residual{&family, std::vector<py::object>(family.members.size())};
  if (args.size() > family.members.size())
    throw py::type_error(family.name + ": takes at most " + std::to_string(family.members.size()) + " arguments");
  for (std::size_t i = 0; i < args.size(); ++i) residual.values[i] = args[i];
  for (const auto& [key, value] : kwargs) {
    const auto name = key.cast<std::string>();
    const auto at = std::find(family.members.begin(), family.members.end(), name);
    if (at == family.members.end()) throw py::type_error(family.name + ": has no argument " + name);
    py::object& member = residual.values[std::size_t(at - family.members.begin())];
    if (member) throw py::type_error(family.name + ": argument " + name + " is given twice");
    member = py::reinterpret_borrow<py::object>(value);
  }
  for (std::size_t i = 0; i < residual.values.size(); ++i) {
    if (residual.values[i] && residual.values[i].is_none()) {
      if (i < family.required) throw py::type_error(family.name + ": " + family.members[i] + " must not be None");
      residual.values[i] = {};
    }
    if (i < family.required && !residual.values[i])
      throw py::type_error(family.name + ": argument " + family.members[i] + " is missing");
  }
  for (std::size_t i = 0; i < residual.values.size(); ++i)
    if (residual.values[i]) check_member(family, i, residual.values[i]);
  return residual;
}

}  // namespace

std::map<std::string, Family>& families() {
  static std::map<std::string, Family> all;
  return all;
}

const detail::ResidualType* registered_type(const std::type_info& type, bool hard) {
  for (const detail::ResidualType* known : detail::residual_types())
    if (known->type() == type && known->hard == hard) return known;
  throw std::logic_error(type_name(type) + " is not registered");
}

BoundResidual::BoundResidual(const FamilyResidual& residual, const std::vector<const Group*>& groups) {
  const Family& family = *residual.family;
  for (const Instance& instance : family.instances)
    if (std::equal(groups.begin(), groups.end(), instance.states.begin(), instance.states.end(),
                   [](const Group* group, const std::type_info* type) { return *group->type == *type; })) {
      instance_ = &instance;
      break;
    }
  if (!instance_) {
    std::string given, known;
    for (const Group* group : groups) given += (given.empty() ? "" : ", ") + group->name;
    for (const Instance& instance : family.instances)
      known += (known.empty() ? "(" : ", (") + group_names(instance.states) + ")";
    throw BadInputError(family.name + ": reads variables of the groups " + known + ", not (" + given + ")");
  }
  members_.reserve(family.members.size());
  for (std::size_t k = 0; k < family.members.size(); ++k) {
    const Member& member = instance_->members[k];
    if (!residual.values[k]) {
      members_.push_back(member.preset);
      continue;
    }
    members_.push_back(member.flatten(residual.values[k], family.name + ": " + family.members[k]));
    const Flat& flat = members_.back();
    count_ = common_size(count_, single_, flat.count, flat.single, family.name + ": " + family.members[k]);
    single_ = single_ && flat.single;
  }
}

void BoundResidual::make(std::size_t i, const detail::ResidualType::Use& use) const {
  numbers_.clear();
  for (const Flat& member : members_) numbers_.insert(numbers_.end(), member.of(i), member.of(i) + member.each);
  Fields fields(numbers_);
  instance_->soft->pass(nullptr, fields, &use);
  if (!fields.complete())
    throw BadInputError(std::string(instance_->soft->functions.name) + ": " +
                        (fields.error().empty() ? "the members have a wrong number of entries" : fields.error()));
}

void bind_family(py::module_& m, const Family& family, const char* doc) {
  m.def(
      family.name.c_str(),
      [&family](const py::args& args, const py::kwargs& kwargs) { return make_residual(family, args, kwargs); }, doc);
}

void bind_residual_class(py::module_& m) {
  py::class_<FamilyResidual> c(m, "Residual", "A residual of the library, or an array of residuals of one type.");
  c.def_property_readonly(
      "name", [](const FamilyResidual& r) { return r.family->name; }, "Name of the function that made the residual.");
  c.def(
      "__call__",
      [](const FamilyResidual& residual, const py::args& states, bool jacobians) {
        return evaluate(residual, states, jacobians);
      },
      py::kw_only(), py::arg("jacobians") = false,
      "__call__(*states, jacobians=False)\n\nReturn the rows at these states, shape (dim,) or (n, dim), and with "
      "`jacobians` also a list of the Jacobians by right perturbations of each state.");
  c.def("__repr__", [](const FamilyResidual& r) {
    std::string text;
    for (std::size_t i = 0; i < r.values.size(); ++i)
      if (r.values[i]) {
        std::string value = py::repr(r.values[i]);
        if (value.size() > 60) value = value.substr(0, 57) + "...";
        for (char& ch : value)
          if (ch == '\n') ch = ' ';
        text += (text.empty() ? "" : ", ") + r.family->members[i] + "=" + value;
      }
    return r.family->name + "(" + text + ")";
  });
  const auto state_of = [](const FamilyResidual& r) {
    py::list values;
    for (const py::object& value : r.values) values.append(value ? value : py::none());
    return py::make_tuple(r.family->name, values);
  };
  c.def(py::pickle(state_of, [](const py::tuple& state) {
    FamilyResidual residual{&families().at(state[0].cast<std::string>()), {}};
    for (const py::handle value : state[1].cast<py::list>())
      residual.values.push_back(value.is_none() ? py::object() : py::reinterpret_borrow<py::object>(value));
    return residual;
  }));
}

}  // namespace tandem::python
