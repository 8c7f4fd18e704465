#pragma once

#include "bind_group.hpp"

namespace tandem::python {

/// Plain numbers of a bundle: those of its parts, one after the other.
template <class... Gs>
struct Packed<Bundle<Gs...>> {
  static constexpr int size = (Packed<Gs>::size + ...);
  static void pack(const Bundle<Gs...>& X, double* to) {
    [&]<int... I>(std::integer_sequence<int, I...>) {
      ((Packed<Gs>::pack(X.template get<I>(), to), to += Packed<Gs>::size), ...);
    }
    (std::make_integer_sequence<int, int(sizeof...(Gs))>());
  }
};

/// Returns a bundle of these parts, or null if they are of other groups.
using MakeBundle = py::object (*)(const py::args& parts);
/// All bundles, in the order of their binding.
std::vector<MakeBundle>& bundles();

template <class... Gs>
py::object make_bundle(const py::args& parts) {
  using B = Bundle<Gs...>;
  if (parts.size() != sizeof...(Gs)) return {};
  return [&]<std::size_t... I>(std::index_sequence<I...>)->py::object {
    if (!(py::isinstance<Elements<Gs>>(parts[I]) && ...)) return {};
    std::size_t count = 1;
    bool single = true;
    const auto join = [&](std::size_t n, bool one) {
      count = common_size(count, single, n, one, "Bundle");
      single = single && one;
    };
    const std::tuple<const Elements<Gs>&...> x(parts[I].template cast<const Elements<Gs>&>()...);
    (join(std::get<I>(x).size(), std::get<I>(x).single), ...);
    return py::cast(map_elements<B>(count, single, [&](std::size_t i) { return B(std::get<I>(x)[i]...); }));
  }
  (std::index_sequence_for<Gs...>());
}

/// Binds the product of groups as a class, for example Bundle_SE3_R3.
template <class... Gs>
void bind_bundle(py::module_& m) {
  using B = Bundle<Gs...>;
  std::string name = "Bundle";
  ((name += "_" + find_group(typeid(Gs))->name), ...);
  auto c = bind_group<B>(m, name, "Products of groups, one or an array; see tandem.Bundle.");
  c.def_property_readonly(
      "parts",
      [](const Elements<B>& x) {
        return [&]<int... I>(std::integer_sequence<int, I...>) {
          return py::make_tuple(
              map_elements<Gs>(x.size(), x.single, [&](std::size_t i) { return x[i].template get<I>(); })...);
        }
        (std::make_integer_sequence<int, int(sizeof...(Gs))>());
      },
      "The parts as a tuple of group elements.");
  bundles().push_back(&make_bundle<Gs...>);
}

void bind_bundles(py::module_& m);

}  // namespace tandem::python
