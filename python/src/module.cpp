#include "bind_bundle.hpp"
#include "callable.hpp"
#include "exit_of_forks.hpp"
#include "interrupt.hpp"
#include "noise.hpp"
#include "problem_object.hpp"
#include "python_error.hpp"
#include "residual_family.hpp"
#include "settings.hpp"
#include "wrapped_residuals.hpp"

namespace {

/// Makes every use of an object whose __init__() has not been called a TypeError. pybind11 would allocate memory for the
/// C++ object without constructing it; this is the only use of type_info::operator_new.
void refuse_uninitialised_objects(const pybind11::module_& m) {
  namespace py = pybind11;
  for (const auto& [name, thing] : m.attr("__dict__").cast<py::dict>()) {
    if (!PyType_Check(thing.ptr())) continue;
    if (auto* type = py::detail::get_type_info(reinterpret_cast<PyTypeObject*>(thing.ptr())))
      type->operator_new = [](std::size_t) -> void* {
        throw py::type_error("the object is not initialised: its __init__() has not been called");
      };
  }
}

}  // namespace

PYBIND11_MODULE(_core, m) {
  using namespace tandem::python;
  m.doc() = "Compiled part of tandem: groups, residuals, problems and solvers.";
  end_forks_without_destructors();
  bind_errors(m);
  bind_interrupt(m);
  bind_rotations(m);
  bind_planar(m);
  bind_poses(m);
  bind_extended_poses(m);
  bind_vectors(m);
  bind_long_vectors(m);
  bind_bundles(m);
  bind_settings(m);
  bind_noise(m);
  bind_residual_class(m);
  bind_measurements(m);
  bind_sightings(m);
  bind_motion(m);
  bind_own_sensors(m);
  bind_dynamics(m);
  bind_quadrotor(m);
  bind_wrapped_residuals(m);
  bind_callable(m);
  bind_variables(m);
  bind_problem(m);
  bind_marginals(m);
  bind_fit_report(m);
  bind_fixed_lag(m);
  bind_calibration(m);
  bind_planner(m);
  bind_online(m);
  refuse_uninitialised_objects(m);
}
