#include "noise.hpp"

#include <algorithm>
#include <limits>

#include <pybind11/eigen.h>
#include <pybind11/stl.h>

#include <tandem/residuals/loss_names.hpp>

namespace tandem::python {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

Eigen::MatrixXd square(py::handle value, const std::string& what) {
  const Numbers M = numbers(value, what);
  if (M.ndim() != 2 || M.shape(0) != M.shape(1))
    throw py::value_error(what + ": expected a square matrix, not shape " + shape_text(M));
  return Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(M.data(), M.shape(0),
                                                                                                  M.shape(1));
}

std::vector<double> side(py::handle value, double missing, const std::string& what) {
  if (value.is_none()) return {missing};
  const Numbers x = numbers(value, what);
  if (x.ndim() > 1) throw py::value_error(what + ": expected a number or one for each row, not shape " + shape_text(x));
  reject_nan(x.data(), std::size_t(x.size()), what);
  return {x.data(), x.data() + x.size()};
}

PyBounds checked(PyBounds bounds, const std::string& what) {
  const std::vector<double>&lower = bounds.lower, &upper = bounds.upper;
  if (lower.size() != 1 && upper.size() != 1 && lower.size() != upper.size())
    throw py::value_error(what + ": there are " + std::to_string(lower.size()) + " lower and " +
                          std::to_string(upper.size()) + " upper bounds");
  for (std::size_t i = 0; i < std::max(lower.size(), upper.size()); ++i) {
    const double low = lower[lower.size() == 1 ? 0 : i], high = upper[upper.size() == 1 ? 0 : i];
    if (low > high || low == kInfinity || high == -kInfinity)
      throw py::value_error(what + ": no number is between the lower bound " + std::string(py::str(py::float_(low))) +
                            " and the upper bound " + std::string(py::str(py::float_(high))));
  }
  if (std::all_of(lower.begin(), lower.end(), [](double x) { return x == -kInfinity; }) &&
      std::all_of(upper.begin(), upper.end(), [](double x) { return x == kInfinity; }) && what != "between")
    throw py::value_error(what + ": an infinite bound is no bound");
  return bounds;
}

std::string text_of(const std::vector<double>& numbers) {
  return py::repr(numbers.size() == 1 ? py::object(py::float_(numbers[0])) : py::object(py::cast(numbers)));
}

}  // namespace

Noises noises(py::handle value, int dim, std::size_t count, const std::string& what) {
  if (py::isinstance<Gaussian>(value)) return {{value.cast<Gaussian>()}};
  const Numbers sigmas = numbers(value, what + ": noise");
  reject_nan(sigmas.data(), std::size_t(sigmas.size()), what + ": noise");
  const auto row = [&](const double* from) { return Gaussian(Eigen::Map<const Eigen::VectorXd>(from, dim).eval()); };
  if (sigmas.ndim() == 0) return {{Gaussian(Eigen::VectorXd::Constant(dim, *sigmas.data()).eval())}};
  if (sigmas.ndim() == 1 && sigmas.shape(0) == dim) return {{row(sigmas.data())}};
  if (sigmas.ndim() == 2 && sigmas.shape(1) == dim && std::size_t(sigmas.shape(0)) == count) {
    Noises result;
    for (std::size_t i = 0; i < count; ++i) result.noises.push_back(row(sigmas.data() + i * std::size_t(dim)));
    return result;
  }
  throw py::value_error(what + ": expected standard deviations of shape (), (" + std::to_string(dim) + ",) or (" +
                        std::to_string(count) + ", " + std::to_string(dim) + "), not " + shape_text(sigmas) +
                        "; use Gaussian.covariance for a matrix");
}

std::vector<double> PyBounds::expanded(const std::vector<double>& rows, int dim, const std::string& what) const {
  if (rows.size() == 1) return std::vector<double>(std::size_t(dim), rows[0]);
  if (rows.size() != std::size_t(dim))
    throw py::value_error(what + ": expected bounds for " + std::to_string(dim) + " rows, not " +
                          std::to_string(rows.size()));
  return rows;
}

PyBounds bounds_of(py::handle value, const std::string& what) {
  if (py::isinstance<PyBounds>(value)) return value.cast<PyBounds>();
  if (py::isinstance<py::tuple>(value) && py::len(value) == 2) {
    const auto pair = py::reinterpret_borrow<py::tuple>(value);
    return checked(
        {side(pair[0], -kInfinity, what + ": lower bound"), side(pair[1], kInfinity, what + ": upper bound")}, what);
  }
  if (value.is_none()) throw py::type_error(what + ": bounds are missing; use equal_to, between, at_least or at_most");
  const std::vector<double> both = side(value, 0, what + ": bounds");
  return {both, both};
}

Loss loss_of(py::handle value) {
  if (value.is_none()) return {};
  if (!py::isinstance<Loss>(value))
    throw py::type_error("loss: expected None or a loss such as Huber(1.0), not a " +
                         std::string(py::str(py::type::of(value).attr("__name__"))) +
                         "; several variables are one list, [x, y]");
  return value.cast<Loss>();
}

void bind_noise(py::module_& m) {
  py::class_<Gaussian> gaussian(
      m, "Gaussian",
      "Zero-mean Gaussian noise.\n\nGaussian(sigmas) has independent rows with these standard deviations.\n\n"
      ">>> import tandem\n>>> tandem.Gaussian([0.1, 0.2]).sigmas\narray([0.1, 0.2])\n");
  gaussian.def(py::init([](py::handle sigmas) {
                 const Numbers x = numbers(sigmas, "Gaussian");
                 if (x.ndim() != 1) throw py::value_error("Gaussian: expected shape (dim,), not " + shape_text(x));
                 return Gaussian(Eigen::Map<const Eigen::VectorXd>(x.data(), x.size()).eval());
               }),
               py::arg("sigmas"));
  gaussian.def_static(
      "covariance", [](py::handle M) { return Gaussian::covariance(square(M, "Gaussian.covariance")); },
      py::arg("matrix"), "covariance(matrix)\n\nReturn the noise with this covariance.");
  gaussian.def_static(
      "information", [](py::handle M) { return Gaussian::information(square(M, "Gaussian.information")); },
      py::arg("matrix"), "information(matrix)\n\nReturn the noise with this inverse covariance.");
  gaussian.def_property_readonly("dim", [](const Gaussian& noise) { return noise.dim(); });
  gaussian.def_property_readonly(
      "matrix", [](const Gaussian& noise) { return noise.covariance_matrix(); }, "The covariance.");
  gaussian.def_property_readonly("sigmas", [](const Gaussian& noise) -> Eigen::VectorXd {
    return noise.covariance_matrix().diagonal().cwiseSqrt();
  });
  gaussian.def("__repr__", [](const Gaussian& noise) {
    const Eigen::VectorXd sigmas = noise.covariance_matrix().diagonal().cwiseSqrt();
    return (noise.is_diagonal() ? "Gaussian(" : "<Gaussian, correlated, sigmas ") +
           std::string(py::repr(py::cast(std::vector<double>(sigmas.data(), sigmas.data() + sigmas.size())))) +
           (noise.is_diagonal() ? ")" : ">");
  });
  gaussian.def(py::pickle(
      [](const Gaussian& noise) {
        return py::make_tuple(noise.is_diagonal()
                                  ? py::object(py::cast(Eigen::VectorXd(noise.diagonal().cwiseInverse())))
                                  : py::object(py::cast(noise.sqrt_information())),
                              noise.is_diagonal());
      },
      [](const py::tuple& state) {
        if (state[1].cast<bool>()) return Gaussian(Eigen::VectorXd(state[0].cast<Eigen::VectorXd>()));
        return Gaussian::square_root(state[0].cast<Eigen::MatrixXd>());
      }));

  py::class_<Loss> loss(m, "Loss", "Robust loss of a cost; see Huber, Cauchy, GemanMcClure, Tukey and StudentT.");
  loss.def_property_readonly("scale", [](const Loss& l) { return l.scale; });
  loss.def_property_readonly("kind", [](const Loss& l) {
    for (const auto& [kind, name] : kLossNames)
      if (kind == l.kind) return std::string(name);
    return std::string();
  });
  loss.def("__repr__", [](const py::object& l) {
    return "<loss " + l.attr("kind").cast<std::string>() + ", scale " + std::string(py::str(l.attr("scale"))) + ">";
  });
  loss.def(py::pickle([](const Loss& l) { return py::make_tuple(int(l.kind), l.scale); },
                      [](const py::tuple& state) {
                        return Loss{static_cast<Loss::Kind>(state[0].cast<int>()), state[1].cast<double>()};
                      }));
  m.def("Huber", &Huber, py::arg("scale"), "Huber(scale)\n\nLoss that is linear above `scale` standard deviations.");
  m.def("Cauchy", &Cauchy, py::arg("scale"), "Cauchy(scale)\n\nLogarithmic loss.");
  m.def("GemanMcClure", &GemanMcClure, py::arg("scale"), "GemanMcClure(scale)\n\nLoss bounded by scale**2.");
  m.def("Tukey", &Tukey, py::arg("scale"), "Tukey(scale)\n\nLoss without influence beyond `scale`.");
  m.def("StudentT", &StudentT, py::arg("dof"), py::arg("rows"),
        "StudentT(dof, rows)\n\nNegative log-density of Student's t distribution over `rows` rows.");

  py::class_<PyBounds> bounds(m, "Bounds",
                              "Bounds of the rows of a constraint; see equal_to, between, at_least, at_most.");
  bounds.def_readonly("lower", &PyBounds::lower).def_readonly("upper", &PyBounds::upper);
  bounds.def("__repr__",
             [](const PyBounds& b) { return "<Bounds " + text_of(b.lower) + " to " + text_of(b.upper) + ">"; });
  bounds.def(py::pickle([](const PyBounds& b) { return py::make_tuple(b.lower, b.upper); },
                        [](const py::tuple& state) {
                          return PyBounds{state[0].cast<std::vector<double>>(), state[1].cast<std::vector<double>>()};
                        }));
  m.def(
      "equal_to",
      [](py::handle value) {
        const std::vector<double> x = side(value, 0, "equal_to");
        return checked(PyBounds{x, x}, "equal_to");
      },
      py::arg("value"), "equal_to(value)\n\nBounds of an equality; value is a number or one for each row.");
  m.def(
      "between",
      [](py::handle lower, py::handle upper) {
        return checked({side(lower, -kInfinity, "between"), side(upper, kInfinity, "between")}, "between");
      },
      py::arg("lower"), py::arg("upper"), "between(lower, upper)\n\nBounds, inclusive.");
  m.def(
      "at_least",
      [](py::handle lower) {
        return checked({side(lower, 0, "at_least"), {kInfinity}}, "at_least");
      },
      py::arg("lower"), "at_least(lower)\n\nLower bound.");
  m.def(
      "at_most",
      [](py::handle upper) {
        return checked({{-kInfinity}, side(upper, 0, "at_most")}, "at_most");
      },
      py::arg("upper"), "at_most(upper)\n\nUpper bound.");
}

}  // namespace tandem::python
