#include <functional>

#include "bind_group.hpp"

namespace tandem::python {

void bind_poses(py::module_& m) {
  using E = Elements<SE3>;
  auto c = bind_group<SE3>(
      m, "SE3",
      "Poses in space, one or an array. Tangent: [x, y, z, rx, ry, rz], translation first [m, rad].\n\n"
      "SE3(rotation, translation) accepts rotation matrices, a scipy Rotation or SO3, and positions.\n\n"
      ">>> import tandem, numpy as np\n>>> x = tandem.SE3.exp([1, 0, 0, 0, 0, 0])\n>>> x.translation\n"
      "array([1., 0., 0.])\n>>> (x @ x).log()[:3]\narray([2., 0., 0.])\n"
      ">>> len(tandem.SE3.exp(np.zeros((100, 6))))\n100\n");
  const auto poses = [](const Elements<SO3>& R, py::handle translation, const std::string& what) {
    const Batch t = batch(translation, {3}, what);
    const std::size_t count = common_size(R.size(), R.single, t.count, t.single, what);
    return map_elements<SE3>(count, R.single && t.single, [&](std::size_t i) {
      return SE3(R[i], Eigen::Map<const Vector<3>>(t.data() + (t.single ? 0 : 3 * i)));
    });
  };
  c.def(py::init([] { return E{{SE3()}, true}; }));
  c.def(py::init([poses](py::handle rotation, py::handle translation) {
          return poses(rotations_in_space(rotation, "SE3"), translation, "SE3");
        }),
        py::arg("rotation"), py::arg("translation"));
  c.def_static(
      "from_matrix",
      [](py::handle matrix) {
        const Batch M = batch(matrix, {4, 4}, "SE3.from_matrix");
        return map_elements<SE3>(M.count, M.single, [&](std::size_t i) {
          const Matrix<4, 4> T = ConstRowMajor<4, 4>(M.data() + 16 * i);
          const SO3 R(checked_rotation<3>(T.topLeftCorner<3, 3>(), "SE3.from_matrix"));
          check_last_row(T, "SE3.from_matrix");
          return SE3(R, T.topRightCorner<3, 1>());
        });
      },
      py::arg("matrix"), "from_matrix(matrix)\n\nReturn the poses of 4 x 4 matrices.");
  c.def_static(
      "from_quaternion",
      [poses](py::handle q, py::handle translation, const std::string& order) {
        return poses(rotations_of_quaternions(q, order, "SE3.from_quaternion"), translation, "SE3.from_quaternion");
      },
      py::arg("q"), py::arg("translation"), py::kw_only(), py::arg("order"),
      "from_quaternion(q, translation, *, order)\n\nReturn poses; order is \"xyzw\" or \"wxyz\".");
  c.def_property_readonly(
      "translation",
      [](const E& x) { return map_vectors<3>(x.size(), x.single, [&](std::size_t i) { return x[i].translation(); }); },
      "Position [m], shape (3,) or (n, 3).");
  c.def_property_readonly(
      "rotation",
      [](const E& x) { return map_elements<SO3>(x.size(), x.single, [&](std::size_t i) { return x[i].rotation(); }); },
      "Rotation as SO3.");
  c.def(
      "quaternion",
      [](const E& x, const std::string& order) {
        return quaternions(x.size(), x.single, order, "SE3.quaternion",
                           [&](std::size_t i) { return x[i].rotation().quaternion(); });
      },
      py::kw_only(), py::arg("order") = "xyzw",
      "quaternion(*, order=\"xyzw\")\n\nReturn the unit quaternions, shape (4,) or (n, 4).");
}

}  // namespace tandem::python
