#pragma once

#include "bind_group.hpp"

namespace tandem::python {

template <int N>
void bind_vector(py::module_& m) {
  using E = Elements<Rn<N>>;
  const std::string name = "R" + std::to_string(N);
  auto c = bind_group<Rn<N>>(m, name, "Vectors under addition, one or an array.");
  c.def(py::init([] { return E{{Rn<N>()}, true}; }));
  c.def(py::init([name](py::handle vector) {
          const Batch x = batch(vector, {N}, name);
          return map_elements<Rn<N>>(x.count, x.single, [&](std::size_t i) { return Rn<N>(tangent_of<Rn<N>>(x, i)); });
        }),
        py::arg("vector"));
  c.def_property_readonly(
      "vector",
      [](const E& x) { return map_vectors<N>(x.size(), x.single, [&](std::size_t i) { return x[i].vector(); }); },
      "The numbers, shape (N,) or (n, N).");
}

}  // namespace tandem::python
