#include <cmath>
#include <functional>

#include "bind_group.hpp"

namespace tandem::python {
namespace {

/// Returns the position of x, y, z and w in the order.
std::array<int, 4> places(const std::string& order, const std::string& what) {
  if (order == "xyzw") return {0, 1, 2, 3};
  if (order == "wxyz") return {1, 2, 3, 0};
  throw py::value_error(what + ": the order of a quaternion is \"xyzw\" or \"wxyz\", not \"" + order + "\"");
}

}  // namespace

Elements<SO3> rotations_of_quaternions(py::handle value, const std::string& order, const std::string& what) {
  const std::array<int, 4> at = places(order, what);
  const Batch q = batch(value, {4}, what);
  return map_elements<SO3>(q.count, q.single, [&](std::size_t i) {
    const double* x = q.data() + 4 * i;
    const Eigen::Quaterniond quaternion(x[at[3]], x[at[0]], x[at[1]], x[at[2]]);
    if (!(std::abs(quaternion.norm() - 1) < 1e-3))
      throw py::value_error(what + ": the quaternion has norm " + std::to_string(quaternion.norm()) + ", not 1");
    return SO3(quaternion);
  });
}

Numbers quaternions(std::size_t count, bool single, const std::string& order, const std::string& what,
                    const std::function<Eigen::Quaterniond(std::size_t)>& of) {
  const std::array<int, 4> at = places(order, what);
  return map_vectors<4>(count, single, [&](std::size_t i) {
    const Vector<4> xyzw = of(i).coeffs();
    Vector<4> q;
    for (int k = 0; k < 4; ++k) q[at[std::size_t(k)]] = xyzw[k];
    return q;
  });
}

Elements<SO3> rotations_in_space(py::handle value, const std::string& what) {
  if (py::isinstance<Elements<SO3>>(value)) return value.cast<Elements<SO3>>();
  if (py::hasattr(value, "as_quat")) return rotations_of_quaternions(value.attr("as_quat")(), "xyzw", what);
  const Batch R = batch(value, {3, 3}, what);
  return map_elements<SO3>(R.count, R.single, [&](std::size_t i) {
    return SO3(checked_rotation<3>(ConstRowMajor<3, 3>(R.data() + 9 * i), what));
  });
}

void bind_rotations(py::module_& m) {
  using E = Elements<SO3>;
  auto c = bind_group<SO3>(m, "SO3",
                           "Rotations in space, one or an array. Tangent: the rotation vector [rad].\n\n"
                           "SO3(rotation) accepts rotation matrices, a scipy Rotation or elements of SO3.\n\n"
                           ">>> import tandem\n>>> tandem.SO3.exp([0, 0, 0.1]).log()\narray([0. , 0. , 0.1])\n");
  c.def(py::init([] { return E{{SO3()}, true}; }));
  c.def(py::init([](py::handle rotation) { return rotations_in_space(rotation, "SO3"); }), py::arg("rotation"));
  c.def_static(
      "from_quaternion",
      [](py::handle q, const std::string& order) { return rotations_of_quaternions(q, order, "SO3.from_quaternion"); },
      py::arg("q"), py::kw_only(), py::arg("order"),
      "from_quaternion(q, *, order)\n\nReturn the rotations of unit quaternions; order is \"xyzw\" or \"wxyz\".");
  c.def(
      "quaternion",
      [](const E& x, const std::string& order) {
        return quaternions(x.size(), x.single, order, "SO3.quaternion",
                           [&](std::size_t i) { return x[i].quaternion(); });
      },
      py::kw_only(), py::arg("order") = "xyzw",
      "quaternion(*, order=\"xyzw\")\n\nReturn the unit quaternions, shape (4,) or (n, 4).");
}

}  // namespace tandem::python
