#pragma once

#include <tandem/residuals/vehicle/vehicle_step.hpp>
#include <tandem/studies/planning/vehicle_file.hpp>

#include "bind_group.hpp"

namespace tandem::python {

/// State of a vehicle with its named actuators.
struct PyVehicleState {
  SE3 pose;
  Vector<6> twist;
  Eigen::VectorXd actuators;
};

template <int N>
Vector<N> vector_of(py::handle value, const std::string& what) {
  if (value.is_none()) return Vector<N>::Zero();
  const Batch x = batch(value, {N}, what);
  if (!x.single) throw py::value_error(what + ": expected one vector of shape (" + std::to_string(N) + ",)");
  return Eigen::Map<const Vector<N>>(x.data());
}

inline SE3 pose_of(py::handle value, const std::string& what) {
  if (!py::isinstance<Elements<SE3>>(value) || !value.cast<const Elements<SE3>&>().single)
    throw py::type_error(what + ": expected one SE3, not " +
                         std::string(py::str(py::type::of(value).attr("__name__"))));
  return value.cast<const Elements<SE3>&>()[0];
}

/// Returns the numbers of the named actuators followed by zeros of the idle ones.
template <int N>
Vector<N> with_idle(const Eigen::VectorXd& named, const Vehicle& vehicle, const std::string& what) {
  if (named.size() != Eigen::Index(vehicle.actuators.size()))
    throw py::value_error(what + ": " + vehicle.name + " has " + std::to_string(vehicle.actuators.size()) +
                          " actuators, not " + std::to_string(named.size()));
  Vector<N> all = Vector<N>::Zero();
  all.head(named.size()) = named;
  return all;
}

template <int N>
VehicleState<N> with_idle(const PyVehicleState& state, const Vehicle& vehicle) {
  return {state.pose, state.twist,
          with_idle<N>(state.actuators.size() ? state.actuators : Eigen::VectorXd::Zero(vehicle.actuators.size()),
                       vehicle, "VehicleState")};
}

/// Binds Vehicle, VehicleState, TargetPrediction, predict_target and Cone.
void bind_plan_inputs(py::module_& m);

}  // namespace tandem::python
