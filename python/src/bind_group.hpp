#pragma once

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>
#include <string>
#include <utility>

#include <pybind11/operators.h>

#include <tandem/lie/operations.hpp>

#include "elements.hpp"
#include "rotation_input.hpp"
#include "selection.hpp"

namespace tandem::python {

/// Plain numbers of an element for compiled functions and repr: vector; angle; quaternion xyzw; or translation,
/// (velocity,) rotation.
template <LieGroup G>
struct Packed;
template <int N>
struct Packed<Rn<N>> {
  static constexpr int size = N;
  static void pack(const Rn<N>& X, double* to) { Eigen::Map<Vector<N>>{to} = X.vector(); }
};
template <>
struct Packed<SO2> {
  static constexpr int size = 1;
  static void pack(const SO2& X, double* to) { *to = X.angle(); }
};
template <>
struct Packed<SE2> {
  static constexpr int size = 3;
  static void pack(const SE2& X, double* to) {
    Eigen::Map<Vector<2>>{to} = X.translation();
    to[2] = X.rotation().angle();
  }
};
template <>
struct Packed<SO3> {
  static constexpr int size = 4;
  static void pack(const SO3& X, double* to) { Eigen::Map<Vector<4>>{to} = X.quaternion().coeffs(); }
};
template <int K>
struct Packed<BasicSEK3<K, double>> {
  static constexpr int size = 3 * K + 4;
  static void pack(const BasicSEK3<K, double>& X, double* to) {
    Eigen::Map<Matrix<3, K>>{to} = X.matrix().template topRightCorner<3, K>();
    Packed<SO3>::pack(X.rotation(), to + 3 * K);
  }
};

/// Throws ValueError unless a and b have equally many elements or one of them is single.
inline std::size_t common_size(std::size_t a, bool a_single, std::size_t b, bool b_single, const std::string& what) {
  if (a_single) return b;
  if (b_single || a == b) return a;
  throw py::value_error(what + ": arrays of " + std::to_string(a) + " and " + std::to_string(b) +
                        " elements do not match; one of them must be single or both equally long");
}

template <int R, int C>
using ConstRowMajor = Eigen::Map<const Eigen::Matrix<double, R, C, C == 1 ? Eigen::ColMajor : Eigen::RowMajor>>;

/// Computes a vector of N entries of each of n elements.
template <int N, class F>
Numbers map_vectors(std::size_t n, bool single, F f) {
  Numbers result = new_array(n, single, {N});
  double* to = result.mutable_data();
  for (std::size_t i = 0; i < n; ++i, to += N) Eigen::Map<Vector<N>>{to} = f(i);
  return result;
}
/// Computes an R × C matrix of each of n elements.
template <int R, int C, class F>
Numbers map_matrices(std::size_t n, bool single, F f) {
  Numbers result = new_array(n, single, {R, C});
  double* to = result.mutable_data();
  for (std::size_t i = 0; i < n; ++i, to += R * C)
    Eigen::Map<Eigen::Matrix<double, R, C, C == 1 ? Eigen::ColMajor : Eigen::RowMajor>>{to} = f(i);
  return result;
}

template <LieGroup G>
Elements<G> map_elements(std::size_t n, bool single, auto f) {
  Elements<G> result;
  result.single = single;
  result.x.reserve(n);
  for (std::size_t i = 0; i < n; ++i) result.x.push_back(f(i));
  return result;
}

template <LieGroup G>
typename G::Tangent tangent_of(const Batch& v, std::size_t i) {
  return Eigen::Map<const typename G::Tangent>(v.data() + (v.single ? 0 : i) * std::size_t(G::dof));
}

template <LieGroup G>
std::string repr(const Elements<G>& x, const std::string& name) {
  if (!x.single) return "<" + name + " array of " + std::to_string(x.size()) + ">";
  double parameters[std::size_t(Packed<G>::size)];
  Packed<G>::pack(x.x[0], parameters);
  std::string text = name + "(";
  char number[32];
  for (int i = 0; i < Packed<G>::size; ++i) {
    std::snprintf(number, sizeof number, "%.6g", parameters[i]);
    text += (i ? ", " : "") + std::string(number);
  }
  return text + ")";
}

/// Returns `value`, or a tuple of it and the Jacobians, which the functions compute.
template <class... Fs>
py::object with_jacobians(bool wanted, py::object value, Fs... jacobians) {
  if (!wanted) return value;
  return py::make_tuple(std::move(value), jacobians()...);
}

/// Registers the group for variables and residuals.
template <LieGroup G>
void register_group(const std::string& name) {
  static const Group group{
      .name = name,
      .type = &typeid(G),
      .dof = G::dof,
      .size = sizeof(G),
      .parameters = Packed<G>::size,
      .holds = [](py::handle value) { return py::isinstance<Elements<G>>(value); },
      .count =
          [](py::handle value) {
            const auto& x = value.cast<const Elements<G>&>();
            return std::pair(x.size(), x.single);
          },
      .element = [](py::handle value, std::size_t i) -> const void* { return &value.cast<const Elements<G>&>()[i]; },
      .make =
          [](const void* const* from, std::size_t n, bool single) {
            return py::cast(map_elements<G>(n, single, [&](std::size_t i) { return *static_cast<const G*>(from[i]); }));
          },
      .pack = [](const void* x, double* to) { Packed<G>::pack(*static_cast<const G*>(x), to); },
      .fields =
          [](const void* x, Fields& fields) {
            G copy = *static_cast<const G*>(x);
            pass_fields(copy, fields);
          },
  };
  groups().push_back(&group);
}

/// Binds the operations that all groups have. tandem/_core.pyi has their types.
template <LieGroup G>
py::class_<Elements<G>> bind_group(py::module_& m, const std::string& name, const char* doc) {
  using E = Elements<G>;
  using Tangent = typename G::Tangent;
  using Jacobian = typename G::Jacobian;
  constexpr int n = G::dof, size = G::matrix_size, points = G::point_dim;
  const auto of = [name](const char* function) { return name + "." + function; };
  const auto jacobian = [](auto f, std::string what) {
    return [f, what](py::handle v) {
      const Batch from = batch(v, {n}, what);
      return map_matrices<n, n>(from.count, from.single,
                                [&](std::size_t i) -> Jacobian { return f(tangent_of<G>(from, i)); });
    };
  };
  py::class_<E> c(m, name.c_str(), doc);
  c.attr("dof") = n;
  c.def_static(
      "identity",
      [](std::optional<std::size_t> count) {
        return E{std::vector<G>(count.value_or(1)), !count};
      },
      py::arg("count") = py::none(), "identity(count=None)\n\nReturn the identity, or an array of `count` identities.");
  c.def_static(
      "exp",
      [what = of("exp")](py::handle v, bool jacobians) {
        const Batch from = batch(v, {n}, what);
        const auto each = [&](auto f) { return [&from, f](std::size_t i) { return f(tangent_of<G>(from, i)); }; };
        return with_jacobians(
            jacobians,
            py::cast(map_elements<G>(from.count, from.single, each([](const Tangent& d) { return G::Exp(d); }))), [&] {
              return map_matrices<n, n>(from.count, from.single, each([](const Tangent& d) { return G::Jr(d); }));
            });
      },
      py::arg("v"), py::kw_only(), py::arg("jacobians") = false,
      "exp(v, *, jacobians=False)\n\nReturn the exponential of tangent vectors, shape (dof,) or (n, dof), with the "
      "Jacobians by v if requested.");
  c.def(
      "log",
      [](const E& x, bool jacobians) {
        return with_jacobians(
            jacobians, map_vectors<n>(x.size(), x.single, [&](std::size_t i) { return x[i].Log(); }), [&] {
              return map_matrices<n, n>(x.size(), x.single,
                                        [&](std::size_t i) -> Jacobian { return G::Jr_inverse(x[i].Log()); });
            });
      },
      py::kw_only(), py::arg("jacobians") = false,
      "log(*, jacobians=False)\n\nReturn the tangent vectors, shape (dof,) or (n, dof), with the Jacobians by X if "
      "requested.");
  c.def(
      "adjoint",
      [](const E& x) { return map_matrices<n, n>(x.size(), x.single, [&](std::size_t i) { return x[i].Ad(); }); },
      "adjoint()\n\nReturn the matrices of v -> vee(X hat(v) X^-1), shape (dof, dof) or (n, dof, dof).");
  c.def(
      "inverse",
      [](const E& x, bool jacobians) {
        return with_jacobians(
            jacobians, py::cast(map_elements<G>(x.size(), x.single, [&](std::size_t i) { return x[i].inverse(); })),
            [&] {
              return map_matrices<n, n>(x.size(), x.single, [&](std::size_t i) -> Jacobian { return -x[i].Ad(); });
            });
      },
      py::kw_only(), py::arg("jacobians") = false,
      "inverse(*, jacobians=False)\n\nReturn the inverse elements, with the Jacobians by X if requested.");
  c.def(
      "matrix",
      [](const E& x) {
        return map_matrices<size, size>(x.size(), x.single, [&](std::size_t i) { return x[i].matrix(); });
      },
      "matrix()\n\nReturn the matrices, of square shape.");
  c.def(
      "__matmul__",
      [what = of("@")](const E& x, const E& y) {
        const std::size_t count = common_size(x.size(), x.single, y.size(), y.single, what);
        return map_elements<G>(count, x.single && y.single, [&](std::size_t i) { return x[i] * y[i]; });
      },
      py::is_operator());
  c.def(
      "act",
      [what = of("act")](const E& x, py::handle p, bool jacobians) {
        const Batch from = batch(p, {points}, what);
        const std::size_t count = common_size(x.size(), x.single, from.count, from.single, what);
        const bool single = x.single && from.single;
        const auto point = [&](std::size_t i) -> Vector<points> {
          return Eigen::Map<const Vector<points>>(from.data() + (from.single ? 0 : i) * points);
        };
        return with_jacobians(
            jacobians, map_vectors<points>(count, single, [&](std::size_t i) { return x[i].act(point(i)); }),
            [&] {
              return map_matrices<points, n>(count, single, [&](std::size_t i) { return x[i].act_jacobian(point(i)); });
            },
            [&] {
              return map_matrices<points, points>(count, single,
                                                  [&](std::size_t i) { return x[i].act_point_jacobian(); });
            });
      },
      py::arg("points"), py::kw_only(), py::arg("jacobians") = false,
      "act(points, *, jacobians=False)\n\nReturn the transformed points, with the Jacobians by X and by the points if "
      "requested.");
  c.def_static("jr", jacobian(&G::Jr, of("jr")), py::arg("v"),
               "jr(v)\n\nReturn the right Jacobians of exp: exp(v + d) = exp(v) exp(jr(v) d).");
  c.def_static("jl", jacobian(&G::Jl, of("jl")), py::arg("v"),
               "jl(v)\n\nReturn the left Jacobians of exp: exp(v + d) = exp(jl(v) d) exp(v).");
  c.def_static("jr_inv", jacobian(&G::Jr_inverse, of("jr_inv")), py::arg("v"),
               "jr_inv(v)\n\nReturn the inverses of jr(v). jr_inv(X.log()) is the Jacobian of X.log().");
  c.def_static("jl_inv", jacobian(&G::Jl_inverse, of("jl_inv")), py::arg("v"),
               "jl_inv(v)\n\nReturn the inverses of jl(v).");
  c.def(
      "plus",
      [what = of("plus")](const E& x, py::handle v, bool jacobians) {
        const Batch d = batch(v, {n}, what);
        const std::size_t count = common_size(x.size(), x.single, d.count, d.single, what);
        const bool single = x.single && d.single;
        return with_jacobians(
            jacobians,
            py::cast(map_elements<G>(count, single, [&](std::size_t i) { return x[i] * G::Exp(tangent_of<G>(d, i)); })),
            [&] {
              return map_matrices<n, n>(count, single,
                                        [&](std::size_t i) -> Jacobian { return G::Exp(-tangent_of<G>(d, i)).Ad(); });
            },
            [&] {
              return map_matrices<n, n>(count, single,
                                        [&](std::size_t i) -> Jacobian { return G::Jr(tangent_of<G>(d, i)); });
            });
      },
      py::arg("v"), py::kw_only(), py::arg("jacobians") = false,
      "plus(v, *, jacobians=False)\n\nReturn X exp(v), with the Jacobians by X and by v if requested.");
  c.def(
      "minus",
      [what = of("minus")](const E& y, const E& x, bool jacobians) -> py::object {
        const std::size_t count = common_size(x.size(), x.single, y.size(), y.single, what);
        const bool single = x.single && y.single;
        Numbers d = map_vectors<n>(count, single, [&](std::size_t i) -> Tangent { return minus(y[i], x[i]); });
        if (!jacobians) return d;
        const double* from = d.data();
        const auto at = [&](std::size_t i) { return Eigen::Map<const Tangent>(from + i * std::size_t(n)); };
        return py::make_tuple(
            d, map_matrices<n, n>(count, single, [&](std::size_t i) -> Jacobian { return G::Jr_inverse(at(i)); }),
            map_matrices<n, n>(count, single, [&](std::size_t i) -> Jacobian { return -G::Jl_inverse(at(i)); }));
      },
      py::arg("other"), py::kw_only(), py::arg("jacobians") = false,
      "minus(other, *, jacobians=False)\n\nReturn log(other^-1 X), with the Jacobians by X and by other if requested.");
  c.def(
      "interpolate",
      [what = of("interpolate")](const E& x, const E& y, py::handle s, bool jacobians) -> py::object {
        const Batch at = batch(s, {}, what + ": s");
        const bool s_single = at.single, xy_single = x.single && y.single, single = s_single && xy_single;
        std::size_t count = common_size(x.size(), x.single, y.size(), y.single, what);
        count = common_size(count, xy_single, at.count, s_single, what);
        const double* fraction = at.data();
        const auto s_of = [&](std::size_t i) { return fraction[s_single ? 0 : i]; };
        E z = map_elements<G>(count, single, [&](std::size_t i) { return interpolate(x[i], y[i], s_of(i)); });
        if (!jacobians) return py::cast(std::move(z));
        Jacobian Jx, Jy;
        Numbers by_x = map_matrices<n, n>(count, single, [&](std::size_t i) -> Jacobian {
          interpolate(x[i], y[i], s_of(i), &Jx, &Jy);
          return Jx;
        });
        Numbers by_y = map_matrices<n, n>(count, single, [&](std::size_t i) -> Jacobian {
          interpolate(x[i], y[i], s_of(i), &Jx, &Jy);
          return Jy;
        });
        return py::make_tuple(std::move(z), by_x, by_y);
      },
      py::arg("other"), py::arg("s"), py::kw_only(), py::arg("jacobians") = false,
      "interpolate(other, s, *, jacobians=False)\n\nReturn the geodesic from X (s = 0) to other (s = 1), with the "
      "Jacobians by X and by other if requested.");

  c.def("__len__", [name](const E& x) {
    if (x.single) throw py::type_error("a single " + name + " has no length");
    return x.size();
  });
  c.def("__iter__", [name](const py::object& self) {
    if (self.cast<const E&>().single) throw py::type_error("a single " + name + " is not iterable");
    return py::reinterpret_steal<py::object>(PySeqIter_New(self.ptr()));
  });
  c.def("__getitem__", [name](const E& x, py::handle index) {
    if (x.single) throw py::type_error("a single " + name + " cannot be indexed");
    const Selection chosen = selection(index, x.size(), name);
    return map_elements<G>(chosen.elements.size(), chosen.single,
                           [&](std::size_t i) { return x.x[chosen.elements[i]]; });
  });
  c.def_property_readonly(
      "parameters",
      [](const E& x) {
        return map_vectors<Packed<G>::size>(x.size(), x.single, [&](std::size_t i) {
          Vector<Packed<G>::size> numbers;
          Packed<G>::pack(x[i], numbers.data());
          return numbers;
        });
      },
      "Plain numbers: the vector, the angle, the quaternion xyzw, or translations followed by the rotation.");
  c.def_static(
      "stack",
      [what = of("stack")](const py::iterable& elements) {
        E all{{}, false};
        for (const py::handle item : elements) {
          if (!py::isinstance<E>(item)) throw py::type_error(what + ": expected elements of the same group");
          const auto& x = item.cast<const E&>();
          all.x.insert(all.x.end(), x.x.begin(), x.x.end());
        }
        return all;
      },
      py::arg("elements"), "stack(elements)\n\nReturn one array of the elements of several objects.");
  c.def("__repr__", [name](const E& x) { return repr(x, name); });
  c.def("__copy__", [](const E& x) { return x; });
  c.def("__deepcopy__", [](const E& x, const py::dict&) { return x; });
  c.def(py::pickle(
      [](const E& x) {
        Fields fields;
        for (G element : x.x) pass_fields(element, fields);
        return py::make_tuple(
            x.single, x.size(),
            py::bytes(reinterpret_cast<const char*>(fields.values().data()), fields.values().size() * sizeof(double)));
      },
      [](const py::tuple& state) {
        E x{std::vector<G>(state[1].cast<std::size_t>()), state[0].cast<bool>()};
        const std::string bytes = state[2].cast<std::string>();
        std::vector<double> numbers(bytes.size() / sizeof(double));
        std::copy(bytes.begin(), bytes.end(), reinterpret_cast<char*>(numbers.data()));
        Fields fields(numbers);
        for (G& element : x.x) pass_fields(element, fields);
        if (!fields.complete()) throw py::value_error("the pickled elements are damaged");
        return x;
      }));
  register_group<G>(name);
  return c;
}

void bind_rotations(py::module_& m);
void bind_planar(py::module_& m);
void bind_poses(py::module_& m);
void bind_extended_poses(py::module_& m);
void bind_vectors(py::module_& m);
void bind_long_vectors(py::module_& m);

}  // namespace tandem::python
