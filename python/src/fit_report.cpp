#include <tandem/solvers/fit_report.hpp>

#include "arrays.hpp"
#include "problem_object.hpp"

namespace tandem::python {
namespace {

py::dict to_python(const SensorFit& fit) {
  py::dict components;
  for (std::size_t c = 0; c < fit.series.size(); ++c) {
    const ResidualSeries& series = fit.series[c];
    components[py::str(fit.components[c])] =
        py::dict(py::arg("mean") = series.mean(), py::arg("sigma") = series.spread(),
                 py::arg("correlation") = series.correlation());
  }
  py::list worst;
  for (const WorstMeasurement& w : fit.worst)
    worst.append(py::dict(py::arg("t") = w.t, py::arg("component") = fit.components[w.component],
                          py::arg("residual") = w.residual));
  return py::dict(py::arg("used") = fit.used, py::arg("rejected") = fit.rejected,
                  py::arg("down_weighted") = fit.down_weighted,
                  py::arg("expected_down_weighted") = fit.expected_down_weighted, py::arg("components") = components,
                  py::arg("worst") = worst, py::arg("misfit") = fit.misfit());
}

/// Returns the content of a fit report, with the keys of summary.json. Block i of a sensor has the time stamp i.
py::dict fit_of(PyProblem& self, const py::dict& sensors) {
  PyProblem::Solve solving(self);
  Problem& problem = self.read();
  std::vector<JudgedSensor> judged;
  std::vector<MeasurementBlock> measurements;
  for (const auto& [name, value] : sensors) {
    if (!py::isinstance<py::str>(name) || !py::isinstance<PyBlocks>(value))
      throw py::type_error("fit_report: expected a dictionary of blocks by name, for example {\"usbl\": blocks}");
    JudgedSensor sensor{name.cast<std::string>(), {}};
    const auto& blocks = value.cast<const PyBlocks&>().blocks;
    for (std::size_t i = 0; i < blocks.size(); ++i) {
      const auto dim = std::size_t(problem.noise(blocks[i]).dim());  // throws for constraints
      while (sensor.components.size() < dim)
        sensor.components.push_back("row " + std::to_string(sensor.components.size()));
      measurements.push_back({judged.size(), double(i), blocks[i]});
    }
    judged.push_back(std::move(sensor));
  }
  const FitReport fit = run_unlocked(solving.stop(), [&] {
    const Marginals marginals(problem);
    return fit_report(problem, judged, measurements, &marginals);
  });
  py::dict of_sensors;
  for (const SensorFit& sensor : fit.sensors) of_sensors[py::str(sensor.name)] = to_python(sensor);
  return py::dict(py::arg("consistent") = fit.consistent(), py::arg("verdict") = fit.verdict(),
                  py::arg("noise_far_too_large") = fit.noise_is_far_too_large(),
                  py::arg("oversized") = fit.oversized_noises(), py::arg("cost") = fit.cost,
                  py::arg("expected_cost") = fit.expected_cost, py::arg("cost_sigma") = fit.cost_sigma,
                  py::arg("sensors") = of_sensors);
}

}  // namespace

void bind_fit_report(py::module_& m) {
  m.def("_fit_report", &fit_of, py::arg("problem"), py::arg("sensors"), "Return the content of a FitReport.");
}

}  // namespace tandem::python
