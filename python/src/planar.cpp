#include "bind_group.hpp"

namespace tandem::python {

Elements<SO2> rotations_in_plane(py::handle value, const std::string& what) {
  if (py::isinstance<Elements<SO2>>(value)) return value.cast<Elements<SO2>>();
  const Numbers array = numbers(value, what);
  if (array.ndim() <= 1) {
    const Batch angle = batch(array, {}, what);
    return map_elements<SO2>(angle.count, angle.single, [&](std::size_t i) { return SO2(angle.data()[i]); });
  }
  const Batch R = batch(array, {2, 2}, what);
  return map_elements<SO2>(R.count, R.single, [&](std::size_t i) {
    const Matrix<2, 2> M = checked_rotation<2>(ConstRowMajor<2, 2>(R.data() + 4 * i), what);
    return SO2(std::atan2(M(1, 0), M(0, 0)));
  });
}

void bind_planar(py::module_& m) {
  using R = Elements<SO2>;
  auto rotation = bind_group<SO2>(m, "SO2",
                                  "Rotations in the plane, one or an array. Tangent: the angle [rad].\n\n"
                                  "SO2(rotation) accepts angles, rotation matrices or elements of SO2.\n\n"
                                  ">>> import tandem\n>>> tandem.SO2(0.5).log()\narray([0.5])\n");
  rotation.def(py::init([] { return R{{SO2()}, true}; }));
  rotation.def(py::init([](py::handle angle) { return rotations_in_plane(angle, "SO2"); }), py::arg("rotation"));
  rotation.def_property_readonly(
      "angle",
      [](const R& x) {
        Numbers angles = new_array(x.size(), x.single, {});
        for (std::size_t i = 0; i < x.size(); ++i) angles.mutable_data()[i] = x[i].angle();
        return angles;
      },
      "Angle in (-pi, pi] [rad].");

  using E = Elements<SE2>;
  auto c =
      bind_group<SE2>(m, "SE2",
                      "Poses in the plane, one or an array. Tangent: [x, y, angle], translation first [m, rad].\n\n"
                      "SE2(rotation, translation) accepts angles, rotation matrices or SO2, and positions.\n\n"
                      ">>> import tandem\n>>> tandem.SE2(0.5, [1, 2])\nSE2(1, 2, 0.5)\n");
  c.def(py::init([] { return E{{SE2()}, true}; }));
  c.def(py::init([](py::handle rotation, py::handle translation) {
          const R angle = rotations_in_plane(rotation, "SE2");
          const Batch t = batch(translation, {2}, "SE2");
          const std::size_t count = common_size(angle.size(), angle.single, t.count, t.single, "SE2");
          return map_elements<SE2>(count, angle.single && t.single, [&](std::size_t i) {
            return SE2(angle[i], Eigen::Map<const Vector<2>>(t.data() + (t.single ? 0 : 2 * i)));
          });
        }),
        py::arg("rotation"), py::arg("translation"));
  c.def_static(
      "from_matrix",
      [](py::handle matrix) {
        const Batch M = batch(matrix, {3, 3}, "SE2.from_matrix");
        return map_elements<SE2>(M.count, M.single, [&](std::size_t i) {
          const Matrix<3, 3> T = ConstRowMajor<3, 3>(M.data() + 9 * i);
          const Matrix<2, 2> turn = checked_rotation<2>(T.topLeftCorner<2, 2>(), "SE2.from_matrix");
          check_last_row(T, "SE2.from_matrix");
          return SE2(SO2(std::atan2(turn(1, 0), turn(0, 0))), T.topRightCorner<2, 1>());
        });
      },
      py::arg("matrix"), "from_matrix(matrix)\n\nReturn the poses of 3 x 3 matrices.");
  c.def_property_readonly(
      "translation",
      [](const E& x) { return map_vectors<2>(x.size(), x.single, [&](std::size_t i) { return x[i].translation(); }); },
      "Position [m], shape (2,) or (n, 2).");
  c.def_property_readonly(
      "rotation",
      [](const E& x) { return map_elements<SO2>(x.size(), x.single, [&](std::size_t i) { return x[i].rotation(); }); },
      "Rotation as SO2.");
}

}  // namespace tandem::python
