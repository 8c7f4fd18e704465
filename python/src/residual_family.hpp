#pragma once

#include <map>
#include <string>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include <tandem/problem/problem.hpp>
#include <tandem/residuals/direction.hpp>

#include "bind_group.hpp"

namespace tandem::python {

/// Numbers of one member of n residuals, as Fields passes them.
struct Flat {
  std::vector<double> numbers;
  std::size_t count = 1, each = 0;
  bool single = true;

  const double* of(std::size_t i) const { return numbers.data() + (single ? 0 : i) * each; }
};

template <class T>
Flat flat_fields(std::size_t count, bool single, auto element) {
  Fields fields;
  for (std::size_t i = 0; i < count; ++i) {
    T x = element(i);
    pass_fields(x, fields);
  }
  return {fields.values(), count, count ? fields.values().size() / count : 0, single};
}

/// Converts a Python value, or an array of them, to the member type T.
template <class T>
struct MemberFrom;
template <>
struct MemberFrom<double> {
  static Flat flatten(py::handle value, const std::string& what) {
    const Batch x = batch(value, {}, what, false);
    return {{x.data(), x.data() + x.count}, x.count, 1, x.single};
  }
};
template <int N>
struct MemberFrom<Vector<N>> {
  static Flat flatten(py::handle value, const std::string& what) {
    const Batch x = batch(value, {N}, what, false);  // bounds may be infinite
    return {{x.data(), x.data() + x.count * N}, x.count, std::size_t(N), x.single};
  }
};
template <int R, int C>
requires(C > 1) struct MemberFrom<Matrix<R, C>> {
  static Flat flatten(py::handle value, const std::string& what) {
    const Batch x = batch(value, {R, C}, what);
    return flat_fields<Matrix<R, C>>(x.count, x.single, [&](std::size_t i) -> Matrix<R, C> {
      return ConstRowMajor<R, C>(x.data() + i * std::size_t(R * C));
    });
  }
};
template <int N>
struct MemberFrom<Direction<N>> {
  static Flat flatten(py::handle value, const std::string& what) {
    const Batch x = batch(value, {N}, what);
    return flat_fields<Direction<N>>(x.count, x.single, [&](std::size_t i) {
      return Direction<N>(Vector<N>(Eigen::Map<const Vector<N>>(x.data() + i * std::size_t(N))));
    });
  }
};
template <LieGroup G>
struct MemberFrom<G> {
  static Flat flatten(py::handle value, const std::string& what) {
    if (!py::isinstance<Elements<G>>(value)) {
      if constexpr (is_vector_space<G>)
        return MemberFrom<typename G::Tangent>::flatten(value, what);
      else if constexpr (std::is_same_v<G, SO3>)
        return of(rotations_in_space(value, what));
      else if constexpr (std::is_same_v<G, SO2>)
        return of(rotations_in_plane(value, what));
      const Group* group = find_group(typeid(G));
      throw py::value_error(what + ": expected " + (group ? group->name : "a group element") + ", not " +
                            std::string(py::str(py::type::of(value).attr("__name__"))));
    }
    return of(value.cast<const Elements<G>&>());
  }
  static Flat of(const Elements<G>& x) {
    return flat_fields<G>(x.size(), x.single, [&](std::size_t i) { return x.x[i]; });
  }
};

/// A member of a residual.
struct Member {
  Flat (*flatten)(py::handle value, const std::string& what);
  Flat preset;
};

/// A residual type for certain groups.
struct Instance {
  std::vector<const std::type_info*> states;
  std::vector<Member> members;
  const detail::ResidualType* soft = nullptr;
  const detail::ResidualType* hard = nullptr;
};

/// A residual template, for example Prior, with its instances.
struct Family {
  std::string name;                  ///< name of the function in Python
  std::vector<std::string> members;  ///< names, in the order of R::fields()
  std::size_t required;              ///< number of members without a default
  std::vector<Instance> instances;
};

/// All families by name.
std::map<std::string, Family>& families();
/// Returns the registered type of R in one role.
const detail::ResidualType* registered_type(const std::type_info& type, bool hard);

template <class Tuple>
struct MembersOf;
template <class... Ts>
struct MembersOf<std::tuple<Ts&...>> {
  static std::vector<Member> list(std::tuple<Ts&...> presets) {
    return std::apply(
        [](auto&... preset) {
          return std::vector<Member>{
              Member{&MemberFrom<Ts>::flatten, flat_fields<Ts>(1, true, [&](std::size_t) { return preset; })}...};
        },
        presets);
  }
};

/// Returns references to x if Python has its type, otherwise to the leaves of its members, in the order of fields().
template <class T>
auto leaves(T& x) {
  if constexpr (requires { &MemberFrom<T>::flatten; })
    return std::tie(x);
  else
    return std::apply([](auto&... members) { return std::tuple_cat(leaves(members)...); }, x.fields());
}

template <class States>
struct TypesOf;
template <class... Xs>
struct TypesOf<std::tuple<Xs...>> {
  static std::vector<const std::type_info*> list() { return {&typeid(Xs)...}; }
};

/// Adds residual R in both roles. A problem that reads R from a file needs this too.
template <Residual R>
void add_instance(Family& family) {
  // Instantiates and thereby registers the type in both roles.
  [[maybe_unused]] static Block (Problem::*volatile const soft)(const R&, const Gaussian&, const VariablesOf<R>&,
                                                                const Loss&) = &Problem::minimize<R>;
  [[maybe_unused]] static Block (Problem::*volatile const hard)(const R&, const Bounds<R::dim>&,
                                                                const VariablesOf<R>&) = &Problem::subject_to<R>;
  R preset{};
  Instance instance;
  instance.states = TypesOf<typename R::States>::list();
  instance.members = MembersOf<decltype(leaves(preset))>::list(leaves(preset));
  instance.soft = registered_type(typeid(R), false);
  instance.hard = registered_type(typeid(R), true);
  if (instance.members.size() != family.members.size())
    throw std::logic_error(family.name + ": the number of names differs from that of the members");
  family.instances.push_back(std::move(instance));
}

/// Binds the function that makes residuals of a family.
void bind_family(py::module_& m, const Family& family, const char* doc);

/// Declares a family with these instances. `members` names the members in order; the first `required` have no default.
template <Residual... Rs>
void declare(py::module_& m, const std::string& name, std::vector<std::string> members, std::size_t required,
             const char* doc) {
  Family& family = families()[name];
  family = {name, std::move(members), required, {}};
  (add_instance<Rs>(family), ...);
  bind_family(m, family, doc);
}

/// A residual of a family with Python values of its members; groups are known when it meets variables.
struct FamilyResidual {
  const Family* family;
  std::vector<py::object> values;  ///< value of each member; null for the default
};

/// The residuals of a FamilyResidual for given groups: one, or an array.
class BoundResidual {
 public:
  /// Throws BadInputError if no instance reads states of these groups, ValueError if a member has a wrong shape.
  BoundResidual(const FamilyResidual& residual, const std::vector<const Group*>& groups);

  const Instance& instance() const { return *instance_; }
  std::size_t count() const { return count_; }
  bool single() const { return single_; }
  int dim() const { return instance_->soft->functions.dim; }
  /// Calls use(residual) with a pointer to residual i.
  void make(std::size_t i, const detail::ResidualType::Use& use) const;

 private:
  const Instance* instance_ = nullptr;
  std::vector<Flat> members_;
  std::size_t count_ = 1;
  bool single_ = true;
  mutable std::vector<double> numbers_;
};

void bind_residual_class(py::module_& m);
void bind_measurements(py::module_& m);
void bind_sightings(py::module_& m);
void bind_motion(py::module_& m);
void bind_own_sensors(py::module_& m);
void bind_dynamics(py::module_& m);
void bind_quadrotor(py::module_& m);

}  // namespace tandem::python
