#include "plan_inputs.hpp"

#include <pybind11/stl.h>

#include <tandem/problem/planning/plan_options.hpp>
#include <tandem/problem/planning/target_prediction.hpp>

#include "residual_in_python.hpp"

namespace tandem::python {
namespace {

void require_positive(double dt, const std::string& what) {
  if (!(dt > 0)) throw BadInputError(what + ": dt is " + std::to_string(dt) + " s; it must be positive");
}

template <int N>
PyVehicleState step(const VehicleModel<N>& model, const Vehicle& vehicle, const PyVehicleState& from,
                    const Eigen::VectorXd& command, double dt, const Vector<3>& current) {
  require_positive(dt, "step");
  if (!command.allFinite()) throw BadInputError("step: the command has an entry that is not finite");
  const VehicleState<N> to =
      VehicleStep<N>(model, dt)(with_idle<N>(from, vehicle), with_idle<N>(command, vehicle, "step"), current);
  return {to.pose, to.twist, to.actuators.head(Eigen::Index(vehicle.actuators.size()))};
}

TargetPrediction prediction_of(const Elements<SE3>& poses, py::handle twists, py::handle covariances) {
  const std::string what = "TargetPrediction";
  const Batch w = batch(twists, {6}, what + ": twists");
  TargetPrediction p{poses.x, {}, {}};
  for (std::size_t i = 0; i < w.count; ++i) p.twist.emplace_back(Eigen::Map<const Vector<6>>(w.data() + 6 * i));
  if (!covariances.is_none()) {
    const Batch S = batch(covariances, {6, 6}, what + ": covariances");
    for (std::size_t i = 0; i < S.count; ++i)
      p.covariance.emplace_back(ConstRowMajor<6, 6>(S.data() + 36 * i));
  }
  if (poses.single || p.twist.size() != p.pose.size() ||
      (!p.covariance.empty() && p.covariance.size() != p.pose.size()))
    throw py::value_error(what + ": expected n poses, twists of shape (n, 6) and covariances of shape (n, 6, 6)");
  return p;
}

TargetPrediction predict(py::handle before, py::handle now, double dt, py::handle noise, double step, int steps,
                         py::handle covariance, py::handle time_constants) {
  TargetBelief belief{pose_of(before, "predict_target"), pose_of(now, "predict_target"), dt};
  if (!covariance.is_none()) {
    const Batch S = batch(covariance, {12, 12}, "predict_target: covariance");
    if (!S.single) throw py::value_error("predict_target: expected one covariance of shape (12, 12)");
    belief.covariance = Eigen::Map<const Matrix<12, 12>>(S.data());
  }
  std::optional<Vector<6>> times;
  if (!time_constants.is_none()) times = vector_of<6>(time_constants, "predict_target: time_constants");
  return predict_target(belief, vector_of<6>(noise, "predict_target: noise"), step, steps, times);
}

void bind_vehicle(py::module_& m) {
  py::class_<PyVehicleState> s(
      m, "VehicleState",
      "Pose, twist over ground along the body axes [m/s, rad/s], and actuator states of a vehicle.\n\n"
      "VehicleState(pose, twist=zeros(6), actuators=None); without actuators, all are zero.");
  s.def(py::init([](py::handle pose, py::handle twist, py::handle actuators) {
          PyVehicleState state{pose_of(pose, "VehicleState"), vector_of<6>(twist, "VehicleState: twist"), {}};
          if (!actuators.is_none()) {
            const Batch a = batch(numbers(actuators, "VehicleState: actuators").attr("ravel")(), {}, "VehicleState");
            state.actuators = Eigen::Map<const Eigen::VectorXd>(a.data(), Eigen::Index(a.count));
          }
          return state;
        }),
        py::arg("pose"), py::arg("twist") = py::none(), py::arg("actuators") = py::none());
  s.def_property_readonly(
      "pose",
      [](const PyVehicleState& x) {
        return Elements<SE3>{{x.pose}, true};
      },
      "Pose in the world.");
  s.def_property_readonly(
      "twist", [](const PyVehicleState& x) { return x.twist; }, "Body twist, shape (6,) [m/s, rad/s].");
  s.def_property_readonly(
      "actuators", [](const PyVehicleState& x) { return x.actuators; },
      "Actuator states in the order of Vehicle.actuators, shape (n,).");
  s.def(py::pickle(
      [](const PyVehicleState& x) {
        return py::make_tuple(Elements<SE3>{{x.pose}, true}, x.twist, x.actuators);
      },
      [](const py::tuple& t) {
        return PyVehicleState{pose_of(t[0], "VehicleState"), t[1].cast<Vector<6>>(), t[2].cast<Eigen::VectorXd>()};
      }));
  s.def("__repr__", [](const PyVehicleState& x) {
    return "<VehicleState at " + repr(Elements<SE3>{{x.pose}, true}, "SE3") + ">";
  });

  py::class_<Vehicle> v(m, "VehicleModel", "A vehicle read from a YAML file; see tandem.Vehicle.");
  v.def(py::init(&read_vehicle), py::arg("file"));
  v.def_readonly("name", &Vehicle::name);
  v.def_readonly("description", &Vehicle::description);
  v.def_readonly("actuators", &Vehicle::actuators, "Names of the actuators.");
  v.def_property_readonly(
      "most_twist", [](const Vehicle& x) { return x.most_twist; }, "Bounds of the twist in plans [m/s, rad/s].");
  const auto limits = [](bool upper) {
    return [upper](const Vehicle& x) {
      return std::visit(
          [&](const auto& model) {
            return Eigen::VectorXd((upper ? model.upper : model.lower).head(Eigen::Index(x.actuators.size())));
          },
          x.model);
    };
  };
  v.def_property_readonly("lower", limits(false), "Lower bounds of the commands.");
  v.def_property_readonly("upper", limits(true), "Upper bounds of the commands.");
  v.def(
      "step",
      [](const Vehicle& vehicle, const PyVehicleState& from, const Eigen::VectorXd& command, double dt,
         py::handle current) {
        const Vector<3> water = vector_of<3>(current, "step: current");
        return std::visit([&](const auto& model) { return step(model, vehicle, from, command, dt, water); },
                          vehicle.model);
      },
      py::arg("state"), py::arg("command"), py::arg("dt"), py::arg("current") = py::none(),
      "step(state, command, dt, current=(0, 0, 0))\n\nReturn the state after dt [s] with a constant command, in a "
      "water current [m/s] along the world axes.");
  v.def(
      "dynamics",
      [](const Vehicle& vehicle, double dt) {
        require_positive(dt, "dynamics");
        return std::visit(
            [&]<int N>(const VehicleModel<N>& model) {
              return in_python("VehicleDynamics", VehicleDynamics<N>(model, dt));
            },
            vehicle.model);
      },
      py::arg("dt"),
      "dynamics(dt)\n\nReturn the equations of motion over dt [s], a VehicleDynamics. The states of the actuators are "
      "R3 for vehicles with at most three actuators, else R8.");
  v.def(
      "actuator_lag",
      [](const Vehicle& vehicle, double dt) {
        require_positive(dt, "actuator_lag");
        return std::visit(
            [&]<int N>(const VehicleModel<N>& model) {
              return in_python("ActuatorLag", ActuatorLag<N>(model.lag, dt));
            },
            vehicle.model);
      },
      py::arg("dt"), "actuator_lag(dt)\n\nReturn the lag of the actuators over dt [s], an ActuatorLag.");
  v.def("__repr__", [](const Vehicle& x) {
    return "<Vehicle " + x.name + ": " + std::to_string(x.actuators.size()) + " actuators>";
  });
}

void bind_prediction(py::module_& m) {
  py::class_<TargetPrediction> t(
      m, "TargetPrediction",
      "Predicted motion of a target at n instants, now and after each step of a plan.\n\n"
      "TargetPrediction(poses, twists, covariances=None): an array of n SE3, body twists of shape (n, 6) [m/s, rad/s], "
      "and covariances of the poses of shape (n, 6, 6), right perturbations [m, rad].");
  t.def(py::init(&prediction_of), py::arg("poses"), py::arg("twists"), py::arg("covariances") = py::none());
  t.def_property_readonly(
      "poses",
      [](const TargetPrediction& x) {
        return Elements<SE3>{x.pose, false};
      },
      "Poses, an array of n SE3.");
  t.def_property_readonly(
      "twists",
      [](const TargetPrediction& x) {
        return map_vectors<6>(x.twist.size(), false, [&](std::size_t i) { return x.twist[i]; });
      },
      "Body twists, shape (n, 6) [m/s, rad/s].");
  t.def_property_readonly(
      "covariances",
      [](const TargetPrediction& x) {
        return map_matrices<6, 6>(x.covariance.size(), false, [&](std::size_t i) { return x.covariance[i]; });
      },
      "Covariances of the poses by right perturbations, shape (n, 6, 6) [m, rad].");
  t.def("__len__", [](const TargetPrediction& x) { return x.pose.size(); });
  t.def("__reduce__", [](const py::object& x) {
    py::object covariances = x.attr("covariances");
    if (py::len(covariances) == 0) covariances = py::none();
    return py::make_tuple(py::type::of(x), py::make_tuple(x.attr("poses"), x.attr("twists"), covariances));
  });
  t.def("__repr__", [](const TargetPrediction& x) {
    return "<TargetPrediction at " + std::to_string(x.pose.size()) + " instants>";
  });
  m.def(
      "predict_target", &predict, py::arg("before"), py::arg("now"), py::arg("dt"), py::kw_only(), py::arg("noise"),
      py::arg("step"), py::arg("steps"), py::arg("covariance") = py::none(), py::arg("time_constants") = py::none(),
      "predict_target(before, now, dt, *, noise, step, steps, covariance=None, time_constants=None)\n\n"
      "Return the prediction of a target over `steps` steps of `step` [s], from two poses dt [s] apart. The twist "
      "continues up to `noise`, shape (6,), in m and rad per root second. `covariance` is that of both poses, shape "
      "(12, 12). With `time_constants`, shape (6,) [s], the twist decays (damped twist).\n\n"
      ">>> import tandem, numpy as np\n"
      ">>> before, now = tandem.SE3(), tandem.SE3.exp([1, 0, 0, 0, 0, 0])\n"
      ">>> tandem.predict_target(before, now, 1.0, noise=np.full(6, 0.01), step=2.0, steps=3).poses.translation[:, 0]\n"
      "array([1., 3., 5., 7.])\n");
  py::class_<Cone>(
      m, "Cone",
      "Cone constraint of a plan. Cone(half_angle, apex=SE3(), point=(0, 0, 0)): half angle [rad]; pose of "
      "the apex, whose x axis is the axis, in the frame of its carrier; point of the other body [m], which "
      "must stay inside.")
      .def(py::init([](double half_angle, py::handle apex, py::handle point) {
             return Cone{half_angle, apex.is_none() ? SE3() : pose_of(apex, "Cone: apex"),
                         vector_of<3>(point, "Cone: point")};
           }),
           py::arg("half_angle"), py::arg("apex") = py::none(), py::arg("point") = py::none())
      .def_readonly("half_angle", &Cone::half_angle, "Half angle [rad].")
      .def("__reduce__",
           [](const py::object& x) {
             const auto& cone = x.cast<const Cone&>();
             return py::make_tuple(py::type::of(x), py::make_tuple(cone.half_angle, Elements<SE3>{{cone.apex}, true},
                                                                   Vector<3>(cone.point)));
           })
      .def("__repr__", [](const Cone& x) { return "<Cone of half angle " + std::to_string(x.half_angle) + " rad>"; });
}

}  // namespace

void bind_plan_inputs(py::module_& m) {
  bind_vehicle(m);
  bind_prediction(m);
}

}  // namespace tandem::python
