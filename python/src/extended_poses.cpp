#include "bind_group.hpp"

namespace tandem::python {

void bind_extended_poses(py::module_& m) {
  using E = Elements<SE23>;
  auto c = bind_group<SE23>(m, "SE23",
                            "Extended poses, one or an array. Tangent: position, velocity, rotation [m, m/s, rad].\n\n"
                            "SE23(rotation, position, velocity) accepts rotations as SO3 does.\n\n"
                            ">>> import tandem\n>>> tandem.SE23.identity().log().shape\n(9,)\n");
  c.def(py::init([] { return E{{SE23()}, true}; }));
  c.def(py::init([](py::handle rotation, py::handle position, py::handle velocity) {
          const Elements<SO3> R = rotations_in_space(rotation, "SE23");
          const Batch p = batch(position, {3}, "SE23"), v = batch(velocity, {3}, "SE23");
          std::size_t count = common_size(R.size(), R.single, p.count, p.single, "SE23");
          count = common_size(count, R.single && p.single, v.count, v.single, "SE23");
          return map_elements<SE23>(count, R.single && p.single && v.single, [&](std::size_t i) {
            Matrix<3, 2> columns;
            columns.col(0) = Eigen::Map<const Vector<3>>(p.data() + (p.single ? 0 : 3 * i));
            columns.col(1) = Eigen::Map<const Vector<3>>(v.data() + (v.single ? 0 : 3 * i));
            return SE23(R[i], columns);
          });
        }),
        py::arg("rotation"), py::arg("position"), py::arg("velocity"));
  c.def_property_readonly(
      "rotation",
      [](const E& x) { return map_elements<SO3>(x.size(), x.single, [&](std::size_t i) { return x[i].rotation(); }); },
      "Rotation as SO3.");
  const auto column = [](int k) {
    return [k](const E& x) {
      return map_vectors<3>(x.size(), x.single,
                            [&](std::size_t i) -> Vector<3> { return x[i].matrix().template block<3, 1>(0, 3 + k); });
    };
  };
  c.def_property_readonly("position", column(0), "Position [m], shape (3,) or (n, 3).");
  c.def_property_readonly("velocity", column(1), "Velocity [m/s], shape (3,) or (n, 3).");
}

}  // namespace tandem::python
