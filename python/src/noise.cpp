#include "noise.hpp"

#include <algorithm>
#include <limits>
#include <optional>

#include <pybind11/eigen.h>
#include <pybind11/stl.h>

#include <tandem/lie/error.hpp>
#include <tandem/residuals/loss_names.hpp>

#include "selection.hpp"
#include "variables.hpp"

namespace tandem::python {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Makes noises from matrices of shape (dim, dim) or (n, dim, dim).
Noises of_matrices(py::handle value, Gaussian (*make)(const Eigen::MatrixXd&), const std::string& what) {
  const Numbers M = numbers(value, what);
  const auto rank = M.ndim();
  if ((rank != 2 && rank != 3) || M.shape(rank - 2) != M.shape(rank - 1))
    throw py::value_error(what + ": expected square matrices of shape (dim, dim) or (n, dim, dim), not " +
                          shape_text(M));
  const py::ssize_t dim = M.shape(rank - 1), count = rank == 3 ? M.shape(0) : 1;
  Noises result{{}, rank == 2};
  result.noises.reserve(std::size_t(count));
  for (py::ssize_t i = 0; i < count; ++i) try {
      result.noises.push_back(make(Eigen::Map<const RowMajor>(M.data() + i * dim * dim, dim, dim)));
    } catch (const Error& error) {
      if (result.single) throw;
      throw BadInputError(what + ": matrix " + std::to_string(i) + " of " + std::to_string(count) + ": " +
                          error.what());
    }
  return result;
}

/// Makes noises from standard deviations of shape (dim,) or (n, dim).
Noises of_sigmas(const Numbers& sigmas) {
  const py::ssize_t dim = sigmas.shape(sigmas.ndim() - 1), count = sigmas.ndim() == 2 ? sigmas.shape(0) : 1;
  Noises result{{}, sigmas.ndim() == 1};
  result.noises.reserve(std::size_t(count));
  for (py::ssize_t i = 0; i < count; ++i)
    result.noises.emplace_back(Eigen::Map<const Eigen::VectorXd>(sigmas.data() + i * dim, dim).eval());
  return result;
}

/// Returns the Gaussians of a list or tuple, or nothing if its first item is none.
std::optional<Noises> listed_noises(py::handle value, const std::string& what) {
  if (!is_list(value) || py::len(value) == 0) return {};
  Noises all{{}, false};
  for (const py::handle item : value) {
    if (!py::isinstance<Noises>(item)) {
      if (all.noises.empty()) return {};
      throw py::type_error(what + ": a list of noises has Gaussians only");
    }
    const auto& part = item.cast<const Noises&>().noises;
    all.noises.insert(all.noises.end(), part.begin(), part.end());
  }
  return all;
}

RowBounds side(py::handle value, double missing, const std::string& what) {
  if (value.is_none()) return {{missing}};
  const Numbers x = numbers(value, what);
  if (x.ndim() > 2)
    throw py::value_error(what + ": expected a number, one for each row (dim,), or of each block (n, dim), not shape " +
                          shape_text(x));
  reject_nan(x.data(), std::size_t(x.size()), what);
  const std::size_t each = x.ndim() == 0 ? 1 : std::size_t(x.shape(x.ndim() - 1));
  if (each == 0) throw py::value_error(what + ": expected bounds of at least one row, not shape " + shape_text(x));
  return {{x.data(), x.data() + x.size()}, each, x.ndim() < 2};
}

PyBounds checked(PyBounds bounds, const std::string& what) {
  const RowBounds &lower = bounds.lower, &upper = bounds.upper;
  if (lower.each != 1 && upper.each != 1 && lower.each != upper.each)
    throw py::value_error(what + ": there are " + std::to_string(lower.each) + " lower and " +
                          std::to_string(upper.each) + " upper bounds");
  if (!lower.single && !upper.single && lower.count() != upper.count())
    throw py::value_error(what + ": there are lower bounds of " + std::to_string(lower.count()) +
                          " and upper bounds of " + std::to_string(upper.count()) + " blocks");
  bool bounded = bounds.count() == 0;
  for (std::size_t i = 0; i < bounds.count(); ++i)
    for (std::size_t k = 0; k < std::max(lower.each, upper.each); ++k) {
      const double low = lower.at(i, k), high = upper.at(i, k);
      if (low > high || low == kInfinity || high == -kInfinity)
        throw py::value_error(what + ": no number is between the lower bound " + std::string(py::str(py::float_(low))) +
                              " and the upper bound " + std::string(py::str(py::float_(high))));
      bounded |= low != -kInfinity || high != kInfinity;
    }
  if (!bounded && what != "between") throw py::value_error(what + ": an infinite bound is no bound");
  return bounds;
}

/// Returns the bounds of the blocks in a list of Bounds, each of one block.
PyBounds listed_bounds(py::handle list, const std::string& what) {
  std::vector<PyBounds> parts;
  PyBounds all{{{}, 1, false}, {{}, 1, false}};
  for (const py::handle item : list) {
    if (!py::isinstance<PyBounds>(item) || !item.cast<const PyBounds&>().single())
      throw py::type_error(what + ": a list of bounds has the Bounds of one block in each item");
    parts.push_back(item.cast<const PyBounds&>());
    all.lower.each = std::max({all.lower.each, parts.back().lower.each, parts.back().upper.each});
  }
  const std::size_t dim = all.upper.each = all.lower.each;
  for (const PyBounds& part : parts) {
    part.check(int(dim), 1, what);
    for (std::size_t k = 0; k < dim; ++k) {
      all.lower.numbers.push_back(part.lower.at(0, k));
      all.upper.numbers.push_back(part.upper.at(0, k));
    }
  }
  return all;
}

/// Returns a list for the bounds of one block, or an array of shape (n, 1) or (n, dim).
py::object to_python(const RowBounds& side) {
  if (side.single) return py::cast(side.numbers);
  Numbers array = new_array(side.count(), false, {py::ssize_t(side.each)});
  std::copy(side.numbers.begin(), side.numbers.end(), array.mutable_data());
  return array;
}

std::string text_of(const RowBounds& side) {
  const std::vector<double>& x = side.numbers;
  return py::repr(x.size() == 1 ? py::object(py::float_(x[0])) : py::object(py::cast(x)));
}

void bind_gaussian(py::module_& m) {
  py::class_<Noises> gaussian(
      m, "Gaussian",
      "Zero-mean Gaussian noise of a block, or an array with the noise of each of n blocks.\n\n"
      "Gaussian(sigmas) has independent rows with these standard deviations, shape (dim,) or (n, dim).\n\n"
      ">>> import tandem, numpy as np\n>>> tandem.Gaussian([0.1, 0.2]).sigmas\narray([0.1, 0.2])\n"
      ">>> len(tandem.Gaussian.information(np.stack([np.eye(6)] * 20)))\n20\n");
  gaussian.def(py::init([](py::handle sigmas) {
                 const Numbers x = numbers(sigmas, "Gaussian");
                 if (x.ndim() != 1 && x.ndim() != 2)
                   throw py::value_error("Gaussian: expected shape (dim,) or (n, dim), not " + shape_text(x));
                 return of_sigmas(x);
               }),
               py::arg("sigmas"));
  gaussian.def_static(
      "covariance", [](py::handle M) { return of_matrices(M, &Gaussian::covariance, "Gaussian.covariance"); },
      py::arg("matrix"),
      "covariance(matrix)\n\nReturn the noise with this covariance, shape (dim, dim) or (n, dim, dim).");
  gaussian.def_static(
      "information", [](py::handle M) { return of_matrices(M, &Gaussian::information, "Gaussian.information"); },
      py::arg("matrix"),
      "information(matrix)\n\nReturn the noise with this inverse covariance, shape (dim, dim) or (n, dim, dim).");
  const auto dim_of = [](const Noises& all) { return all.noises.empty() ? Eigen::Index(0) : all.noises[0].dim(); };
  const auto sigmas_of = [](const Gaussian& noise) -> Eigen::VectorXd {
    return noise.covariance_matrix().diagonal().cwiseSqrt();
  };
  gaussian.def_property_readonly("dim", dim_of, "Number of rows.");
  gaussian.def_property_readonly(
      "matrix",
      [dim_of](const Noises& all) {
        const Eigen::Index dim = dim_of(all);
        Numbers result = new_array(all.noises.size(), all.single, {dim, dim});
        double* to = result.mutable_data();
        for (const Gaussian& noise : all.noises) {
          Eigen::Map<RowMajor>(to, dim, dim) = noise.covariance_matrix();
          to += dim * dim;
        }
        return result;
      },
      "The covariance, shape (dim, dim) or (n, dim, dim).");
  gaussian.def_property_readonly(
      "sigmas",
      [dim_of, sigmas_of](const Noises& all) {
        Numbers result = new_array(all.noises.size(), all.single, {dim_of(all)});
        double* to = result.mutable_data();
        for (const Gaussian& noise : all.noises) {
          const Eigen::VectorXd sigmas = sigmas_of(noise);
          to = std::copy(sigmas.begin(), sigmas.end(), to);
        }
        return result;
      },
      "Standard deviations of the rows, shape (dim,) or (n, dim).");
  gaussian.def("__len__", [](const Noises& all) {
    if (all.single) throw py::type_error("a single Gaussian has no length");
    return all.noises.size();
  });
  gaussian.def("__getitem__", [](const Noises& all, py::handle index) {
    if (all.single) throw py::type_error("a single Gaussian cannot be indexed");
    const Selection chosen = selection(index, all.noises.size(), "Gaussian");
    Noises part{{}, chosen.single};
    for (const std::size_t i : chosen.elements) part.noises.push_back(all.noises[i]);
    return part;
  });
  gaussian.def("__repr__", [sigmas_of](const Noises& all) {
    if (!all.single) return "<Gaussian array of " + std::to_string(all.noises.size()) + ">";
    const Gaussian& noise = all.noises[0];
    const Eigen::VectorXd sigmas = sigmas_of(noise);
    return (noise.is_diagonal() ? "Gaussian(" : "<Gaussian, correlated, sigmas ") +
           std::string(py::repr(py::cast(std::vector<double>(sigmas.data(), sigmas.data() + sigmas.size())))) +
           (noise.is_diagonal() ? ")" : ">");
  });
  gaussian.def(py::pickle(
      [](const Noises& all) {
        py::list list;
        for (const Gaussian& noise : all.noises)
          list.append(noise.is_diagonal() ? py::object(py::cast(Eigen::VectorXd(noise.diagonal().cwiseInverse())))
                                          : py::object(py::cast(noise.sqrt_information())));
        return py::make_tuple(list, all.single);
      },
      [](const py::tuple& state) {
        Noises all{{}, state[1].cast<bool>()};
        for (const py::handle item : state[0].cast<py::list>())
          all.noises.push_back(py::reinterpret_borrow<py::array>(item).ndim() == 1
                                   ? Gaussian(item.cast<Eigen::VectorXd>())
                                   : Gaussian::square_root(item.cast<Eigen::MatrixXd>()));
        return all;
      }));
}

}  // namespace

Noises noises(py::handle value, int dim, std::size_t count, const std::string& what) {
  std::optional<Noises> known = listed_noises(value, what);
  if (!known && py::isinstance<Noises>(value)) known = value.cast<const Noises&>();
  if (known) {
    if (!known->single && known->noises.size() != count)
      throw py::value_error(what + ": there are noises of " + std::to_string(known->noises.size()) + " blocks for " +
                            std::to_string(count) + " blocks");
    for (const Gaussian& noise : known->noises)
      if (noise.dim() != dim)
        throw py::value_error(what + ": expected noise of " + std::to_string(dim) + " rows, not of " +
                              std::to_string(noise.dim()));
    return *std::move(known);
  }
  const Numbers sigmas = numbers(value, what + ": noise");
  reject_nan(sigmas.data(), std::size_t(sigmas.size()), what + ": noise");
  if (sigmas.ndim() == 0) return {{Gaussian(Eigen::VectorXd::Constant(dim, *sigmas.data()).eval())}};
  const bool one = sigmas.ndim() == 1, of_blocks = sigmas.ndim() == 2 && std::size_t(sigmas.shape(0)) == count;
  if ((one || of_blocks) && sigmas.shape(sigmas.ndim() - 1) == dim) return of_sigmas(sigmas);
  throw py::value_error(what + ": expected standard deviations of shape (), (" + std::to_string(dim) + ",) or (" +
                        std::to_string(count) + ", " + std::to_string(dim) + "), not " + shape_text(sigmas) +
                        "; use Gaussian.covariance or Gaussian.information for matrices");
}

void PyBounds::check(int dim, std::size_t n, const std::string& what) const {
  for (const RowBounds* side : {&lower, &upper})
    if (side->each != 1 && side->each != std::size_t(dim))
      throw py::value_error(what + ": expected bounds for " + std::to_string(dim) + " rows, not " +
                            std::to_string(side->each) + "; bounds of each of n blocks have shape (n, " +
                            std::to_string(dim) + ")");
  if (!single() && count() != n)
    throw py::value_error(what + ": there are bounds of " + std::to_string(count()) + " blocks for " +
                          std::to_string(n) + " blocks");
}

std::vector<double> PyBounds::rows(const RowBounds& side, std::size_t block, int dim) {
  std::vector<double> all(static_cast<std::size_t>(dim));
  for (std::size_t k = 0; k < all.size(); ++k) all[k] = side.at(block, k);
  return all;
}

PyBounds bounds_of(py::handle value, const std::string& what) {
  if (py::isinstance<PyBounds>(value)) return value.cast<PyBounds>();
  if (is_list(value) && py::len(value) > 0 && py::isinstance<PyBounds>(value[py::int_(0)]))
    return listed_bounds(value, what);
  if (py::isinstance<py::tuple>(value) && py::len(value) == 2) {
    const auto pair = py::reinterpret_borrow<py::tuple>(value);
    return checked(
        {side(pair[0], -kInfinity, what + ": lower bound"), side(pair[1], kInfinity, what + ": upper bound")}, what);
  }
  if (value.is_none()) throw py::type_error(what + ": bounds are missing; use equal_to, between, at_least or at_most");
  const RowBounds both = side(value, 0, what + ": bounds");
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
  bind_gaussian(m);
  py::class_<Loss> loss(m, "Loss", "Robust loss of a cost; see Huber, Cauchy, GemanMcClure, Tukey and StudentT.");
  loss.def_property_readonly(
      "scale", [](const Loss& l) { return l.scale; }, "Scale in standard deviations.");
  loss.def_property_readonly(
      "kind",
      [](const Loss& l) {
        for (const auto& [kind, name] : kLossNames)
          if (kind == l.kind) return std::string(name);
        return std::string();
      },
      "Name of the loss, for example \"huber\".");
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
  m.def(
      "StudentT",
      [](double dof, int rows) {
        if (rows < 1) throw BadInputError("StudentT: rows is the number of rows, at least 1, not " + std::to_string(rows));
        return StudentT(dof, rows);
      },
      py::arg("dof"), py::arg("rows"),
      "StudentT(dof, rows)\n\nNegative log-density of Student's t distribution over `rows` rows.");

  py::class_<PyBounds> bounds(
      m, "Bounds",
      "Bounds of the rows of a constraint, for all blocks or for each of n blocks; see equal_to, between, at_least, "
      "at_most.");
  bounds.def_property_readonly(
      "lower", [](const PyBounds& b) { return to_python(b.lower); },
      "Lower bounds: one for all rows or one for each; an array with one row for each block if these differ.");
  bounds.def_property_readonly(
      "upper", [](const PyBounds& b) { return to_python(b.upper); },
      "Upper bounds: one for all rows or one for each; an array with one row for each block if these differ.");
  bounds.def("__repr__", [](const PyBounds& b) {
    if (!b.single()) return "<Bounds of " + std::to_string(b.count()) + " blocks>";
    return "<Bounds " + text_of(b.lower) + " to " + text_of(b.upper) + ">";
  });
  bounds.def(py::pickle([](const PyBounds& b) { return py::make_tuple(to_python(b.lower), to_python(b.upper)); },
                        [](const py::tuple& state) {
                          return PyBounds{side(state[0], 0, "Bounds"), side(state[1], 0, "Bounds")};
                        }));
  m.def(
      "equal_to",
      [](py::handle value) {
        const RowBounds x = side(value, 0, "equal_to");
        return checked(PyBounds{x, x}, "equal_to");
      },
      py::arg("value"),
      "equal_to(value)\n\nBounds of an equality; value is a number, one for each row (dim,), or one for each row of "
      "each block (n, dim).");
  m.def(
      "between",
      [](py::handle lower, py::handle upper) {
        return checked({side(lower, -kInfinity, "between"), side(upper, kInfinity, "between")}, "between");
      },
      py::arg("lower"), py::arg("upper"),
      "between(lower, upper)\n\nBounds, inclusive; numbers or arrays of shape (dim,) or (n, dim).\n\n"
      ">>> import tandem\n>>> tandem.between(0, [1, 2])\n<Bounds 0.0 to [1.0, 2.0]>\n");
  m.def(
      "at_least",
      [](py::handle lower) {
        return checked({side(lower, 0, "at_least"), {{kInfinity}}}, "at_least");
      },
      py::arg("lower"), "at_least(lower)\n\nLower bound; a number or an array of shape (dim,) or (n, dim).");
  m.def(
      "at_most",
      [](py::handle upper) {
        return checked({{{-kInfinity}}, side(upper, 0, "at_most")}, "at_most");
      },
      py::arg("upper"), "at_most(upper)\n\nUpper bound; a number or an array of shape (dim,) or (n, dim).");
}

}  // namespace tandem::python
