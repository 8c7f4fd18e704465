#include <tandem/solvers/calibration/calibrate.hpp>
#include <tandem/solvers/option_fields.hpp>

#include "options.hpp"
#include "problem_object.hpp"
#include "watched_solve.hpp"

namespace tandem::python {
namespace {

using Problems = std::vector<std::shared_ptr<PyProblem>>;

/// Problems that are calibrated together, marked as being solved.
struct Solving {
  explicit Solving(const Problems& problems) {
    for (const auto& problem : problems) {
      marks.push_back(std::make_unique<PyProblem::Solve>(*problem));
      all.push_back(&problem->read());
    }
  }
  std::vector<std::unique_ptr<PyProblem::Solve>> marks;
  std::vector<Problem*> all;
};

/// Returns f(item) of each item of a list or tuple, or of a single object.
template <class F>
void for_each(py::handle value, F f) {
  if (py::isinstance<py::list>(value)) {
    for (const py::handle item : value) f(item);
  } else {
    f(value);
  }
}

/// Adds the rows of an entry of a group: Blocks, or (Blocks, rows) with the index of a row or a slice.
void add_rows(const Problem& problem, int index, const std::string& name, py::handle entry, NoiseGroup& group) {
  const std::string what = "Calibration: group " + name;
  py::handle blocks = entry;
  py::object rows = py::slice(0, PY_SSIZE_T_MAX, 1);
  if (py::isinstance<py::tuple>(entry) && py::len(entry) == 2) {
    blocks = entry[py::int_(0)].ptr();
    rows = entry[py::int_(1)];
  }
  if (!py::isinstance<PyBlocks>(blocks))
    throw py::type_error(what + ": expected blocks of costs, or (blocks, rows), not " +
                         std::string(py::str(py::type::of(blocks).attr("__name__"))));
  for (const Block& block : blocks.cast<const PyBlocks&>().blocks) {
    const auto dim = std::size_t(problem.linearization(block).residual.size());
    std::size_t first, stop, step, count;
    if (py::isinstance<py::int_>(rows)) {
      const py::int_ index = py::reinterpret_borrow<py::int_>(rows);
      if (index.attr("__lt__")(0).cast<bool>() || index.attr("__ge__")(dim).cast<bool>())
        throw BadInputError(what + ": row " + std::string(py::str(index)) + " of a block with " + std::to_string(dim) +
                            " rows; they count from 0");
      first = index.cast<std::size_t>();
      count = 1;
    } else if (!py::isinstance<py::slice>(rows) || !rows.cast<py::slice>().compute(dim, &first, &stop, &step, &count) ||
               step != 1) {
      throw py::type_error(what + ": rows are an index or a slice with step 1, not " + std::string(py::repr(rows)));
    }
    group.rows.push_back({block, int(first), int(count), index});
  }
}

std::vector<NoiseGroup> noise_groups(const std::vector<Problem*>& problems, py::handle groups, const py::dict& priors) {
  std::vector<NoiseGroup> all;
  int index = 0;
  for_each(groups, [&](py::handle of_problem) {
    if (!py::isinstance<py::dict>(of_problem) || std::size_t(index) == problems.size())
      throw py::type_error("Calibration: expected a dictionary {name: blocks}, or a list of one for each problem");
    for (const auto& [key, value] : py::reinterpret_borrow<py::dict>(of_problem)) {
      const std::string name = py::str(key);
      auto at = std::find_if(all.begin(), all.end(), [&](const NoiseGroup& g) { return g.name == name; });
      if (at == all.end()) at = all.insert(at, {name, {}});
      for_each(value, [&](py::handle entry) { add_rows(*problems[std::size_t(index)], index, name, entry, *at); });
    }
    ++index;
  });
  for (const auto& [key, value] : priors) {
    const std::string name = py::str(key);
    const auto at = std::find_if(all.begin(), all.end(), [&](const NoiseGroup& g) { return g.name == name; });
    if (at == all.end()) throw BadInputError("Calibration: priors name the group " + name + ", which does not exist");
    if (!py::isinstance<py::float_>(value) && !py::isinstance<py::int_>(value))
      throw py::type_error("Calibration: the prior of " + name + " is a number, not " + std::string(py::repr(value)));
    at->prior = value.cast<double>();
  }
  return all;
}

std::vector<MeasuredBlock> measured_blocks(std::size_t problems, py::handle measured) {
  std::vector<MeasuredBlock> all;
  if (measured.is_none()) return all;
  int index = 0;
  const auto add = [&](py::handle blocks) {
    if (!py::isinstance<PyBlocks>(blocks)) throw py::type_error("Calibration: measured is a list of blocks");
    for (const Block& block : blocks.cast<const PyBlocks&>().blocks) all.push_back({block, index});
  };
  if (problems == 1) {
    for_each(measured, add);
  } else {
    for_each(measured, [&](py::handle of_problem) {
      for_each(of_problem, add);
      ++index;
    });
  }
  return all;
}

Calibration calibrate_problems(const Problems& problems, py::handle groups, const py::dict& priors, py::handle measured,
                               const py::object& progress, const py::kwargs& given) {
  CalibrationOptions o;
  Options read("Calibration", given);
  read("max_iterations", o.max_iterations);
  read("tolerance", o.tolerance);
  read("max_factor", o.max_factor);
  read("ranges", o.ranges);
  read("profile_points", o.profile_points);
  read("absolute_evidence", o.absolute_evidence);
  read.finish();
  const Solving solving(problems);
  const std::vector<NoiseGroup> all = noise_groups(solving.all, groups, priors);
  o.measured = measured_blocks(problems.size(), measured);
  WatchedSolve watched(progress);
  o.stop = Stop(&watched.stop());
  o.solve = [&watched](Problem& problem) {
    const auto run = [&](auto options) {
      options.stop = &watched.stop();
      options.progress = [&watched](const Progress&) { watched.poll(); };
      return solve(problem, options);
    };
    return problem.num_hard_blocks() > 0 ? run(AugmentedLagrangianOptions{}) : run(GaussNewtonOptions{});
  };
  o.progress = [&](int iteration, const Eigen::VectorXd& factors, double gain) {
    watched.report([&] {
      py::dict by_name;
      for (std::size_t i = 0; i < all.size(); ++i) by_name[py::str(all[i].name)] = factors[Eigen::Index(i)];
      return py::dict(py::arg("iteration") = iteration, py::arg("factors") = by_name, py::arg("gain") = gain);
    });
  };
  Calibration found = watched.run([&] {
    Calibration all_found = calibrate(solving.all, all, o);
    apply(all_found, solving.all, all);
    all_found.problems.clear();  // nothing reads the copies
    return all_found;
  });
  for (const auto& problem : problems) problem->set_solved(found.status == Status::converged, found.message);
  return found;
}

}  // namespace

void bind_calibration(py::module_& m) {
  py::class_<CalibratedNoise> n(m, "CalibratedNoise", "The calibrated factor of one noise group of a Calibration.");
  n.def_readonly("name", &CalibratedNoise::name, "Name of the group.");
  n.def_readonly("factor", &CalibratedNoise::factor, "Factor of the given standard deviations.");
  n.def_readonly("log_error", &CalibratedNoise::log_error,
                 "Standard error of log(factor), about the relative standard error of the factor.");
  n.def_readonly("identifiable", &CalibratedNoise::identifiable,
                 "Whether the data determine the factor. If not, and unless it is `bounded`, it is 1.");
  n.def_readonly("bounded", &CalibratedNoise::bounded, "Whether the evidence limits the factor on one side only.");
  n.def_readonly("at_limit", &CalibratedNoise::at_limit, "Whether the factor reached max_factor or its inverse.");
  n.def_property_readonly(
      "flat", [](const CalibratedNoise& c) { return std::pair(c.flat_from, c.flat_to); },
      "Range of factors over which the log evidence stays within 2 of its maximum.");
  n.def_readonly("gain", &CalibratedNoise::gain, "Increase of the log evidence from the given factor.");
  n.def_property_readonly(
      "profile",
      [](const CalibratedNoise& c) {
        Numbers profile({py::ssize_t(c.profile.size()), py::ssize_t(2)});
        double* to = profile.mutable_data();
        for (const auto& [factor, evidence] : c.profile) {
          *to++ = factor;
          *to++ = evidence;
        }
        return profile;
      },
      "Profile evidence, shape (profile_points, 2): factor, and log evidence minus that at the estimate.");
  n.def_readonly("rows", &CalibratedNoise::rows, "Number of residual rows.");
  n.def_readonly("effective_rows", &CalibratedNoise::effective_rows,
                 "Degrees of freedom that are left after the states are estimated.");
  n.def(py::pickle(
      [](const CalibratedNoise& c) {
        return py::make_tuple(c.name, c.factor, c.log_error, c.identifiable, c.bounded, c.at_limit, c.flat_from,
                              c.flat_to, c.gain, c.profile, c.rows, c.effective_rows);
      },
      [](const py::tuple& t) {
        return CalibratedNoise{t[0].cast<std::string>(), t[1].cast<double>(), t[2].cast<double>(), t[3].cast<bool>(),
                               t[4].cast<bool>(),        t[5].cast<bool>(),   t[6].cast<double>(), t[7].cast<double>(),
                               t[8].cast<double>(),      t[9].cast<std::vector<std::pair<double, double>>>(),
                               t[10].cast<double>(),     t[11].cast<double>()};
      }));
  n.def("__repr__", [](const CalibratedNoise& c) {
    const char* const verdict = c.identifiable ? "" : c.bounded ? ", bounded" : ", not identifiable";
    return "<" + c.name + ": factor " + std::string(py::str(py::float_(c.factor))) + verdict + ">";
  });

  py::class_<Calibration> c(
      m, "Calibration",
      "Noise calibration: the factors of standard deviations that maximise the marginal likelihood (evidence).\n\n"
      "Calibration(problem, groups, *, priors={}, measured=None, progress=None, **options)\n\n"
      "The problem is left solved with the calibrated noise. Problems may be a list; `groups` and `measured` then are "
      "lists with one entry for each.\n\n"
      "Args:\n"
      "    problem: a Problem, or a list of problems that share the factors.\n"
      "    groups: {name: blocks}. All rows of a group share one factor. Instead of blocks, (blocks, rows) selects "
      "rows by an index or a slice; a list joins several of them.\n"
      "    priors: standard deviation of log(factor) before the data are seen, by name; 1 by default, 0 for none.\n"
      "    measured: list of the blocks that are measurements, if the others are priors that need not be normalised.\n"
      "    progress: function of a dictionary with iteration, factors and gain.\n"
      "    options: max_iterations, tolerance, max_factor, ranges, profile_points, absolute_evidence.\n\n"
      ">>> import tandem, numpy as np\n"
      ">>> p = tandem.Problem()\n"
      ">>> x = p.add(tandem.R1([0.0]), 'x')\n"
      ">>> z = np.random.default_rng(1).normal(scale=0.5, size=(200, 1))\n"
      ">>> scale = p.minimize(tandem.Prior(tandem.R1(z)), 1.0, x)      # the given noise is twice too large\n"
      ">>> c = tandem.Calibration(p, {'scale': scale})\n"
      ">>> round(c.factors['scale'], 1), c.noise['scale'].identifiable\n"
      "(0.5, True)\n");
  c.def(py::init([](const std::shared_ptr<PyProblem>& problem, py::handle groups, const py::dict& priors,
                    py::handle measured, const py::object& progress, const py::kwargs& given) {
          return calibrate_problems({problem}, groups, priors, measured, progress, given);
        }),
        py::arg("problem").none(false), py::arg("groups"), py::kw_only(), py::arg("priors") = py::dict(),
        py::arg("measured") = py::none(), py::arg("progress") = py::none());
  c.def(py::init(&calibrate_problems), py::arg("problem"), py::arg("groups"), py::kw_only(),
        py::arg("priors") = py::dict(), py::arg("measured") = py::none(), py::arg("progress") = py::none());
  c.def_property_readonly(
      "status", [](const Calibration& x) { return std::string(name(x.status)); },
      "\"converged\", or why the calibration ended.");
  c.def_readonly("message", &Calibration::message, "The status in words.");
  c.def_property_readonly("converged", &Calibration::converged, "Whether the status is \"converged\".");
  c.def_property_readonly(
      "noise",
      [](const Calibration& x) {
        py::dict all;
        for (const CalibratedNoise& noise : x.noise) all[py::str(noise.name)] = noise;
        return all;
      },
      "CalibratedNoise of each group by name.");
  c.def_property_readonly(
      "factors",
      [](const Calibration& x) {
        py::dict all;
        for (const CalibratedNoise& noise : x.noise) all[py::str(noise.name)] = noise.factor;
        return all;
      },
      "Factors of the given standard deviations by name.");
  c.def_property_readonly(
      "log_covariance", [](const Calibration& x) { return x.log_covariance; },
      "Posterior covariance of the log factors, in the order of the groups; zero for factors that are kept.");
  c.def_readonly("gain", &Calibration::gain, "Increase of the log evidence over the given noise.");
  c.def_readonly("log_evidence", &Calibration::log_evidence, "Log evidence of the calibrated noise.");
  c.def_readonly("iterations", &Calibration::iterations, "Number of steps of the factors.");
  c.def_readonly("solves", &Calibration::solves, "Number of solves of a problem.");
  c.def(py::pickle(
      [](const Calibration& x) {
        return py::make_tuple(int(x.status), x.message, x.noise, x.log_covariance, x.gain, x.log_evidence,
                              x.counted_rows, x.iterations, x.solves);
      },
      [](const py::tuple& t) {
        return Calibration{Status(t[0].cast<int>()),
                           t[1].cast<std::string>(),
                           t[2].cast<std::vector<CalibratedNoise>>(),
                           t[3].cast<Eigen::MatrixXd>(),
                           t[4].cast<double>(),
                           t[5].cast<double>(),
                           {},
                           t[6].cast<Eigen::VectorXd>(),
                           t[7].cast<int>(),
                           t[8].cast<int>()};
      }));
  c.def("__repr__", [](const Calibration& x) {
    std::string text = "<Calibration: " + std::string(name(x.status));
    for (const CalibratedNoise& noise : x.noise)
      text += ", " + noise.name + " " + std::string(py::str(py::float_(noise.factor)));
    return text + ">";
  });
}

}  // namespace tandem::python
