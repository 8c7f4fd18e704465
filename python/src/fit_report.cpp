#include <tandem/studies/fit/fit_text.hpp>

#include "problem_object.hpp"

namespace tandem::python {
namespace {

/// Returns a fit report as JSON, with the keys of summary.json. Block i of a sensor has the time stamp i.
std::string fit_of(PyProblem& self, const py::dict& sensors) {
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
    const Marginals marginals = Marginals::without_gauges(problem);
    return fit_report(problem, judged, measurements, &marginals);
  });
  return json_line(fit_fields()(fit));
}

}  // namespace

void bind_fit_report(py::module_& m) {
  m.def("_fit_report", &fit_of, py::arg("problem"), py::arg("sensors"), "Return a FitReport as JSON.");
}

}  // namespace tandem::python
