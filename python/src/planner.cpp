#include <variant>

#include <tandem/solvers/option_fields.hpp>
#include <tandem/solvers/replanning/planner.hpp>
#include <tandem/studies/planning/vehicle_file.hpp>

#include "exclusive.hpp"
#include "noise.hpp"
#include "options.hpp"
#include "problem_object.hpp"
#include "watched_solve.hpp"

namespace tandem::python {
namespace {

using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

constexpr NamedValue<PlanSolver> kPlanSolvers[] = {{"augmented-lagrangian", PlanSolver::augmented_lagrangian},
                                                   {"ipopt", PlanSolver::ipopt},
                                                   {"nlopt:slsqp", PlanSolver::slsqp}};

/// State of a vehicle with its named actuators.
struct PyVehicleState {
  SE3 pose;
  Vector<6> twist;
  Eigen::VectorXd actuators;
};

/// A plan with its named actuators.
struct PyPlan {
  Elements<SE3> poses;
  Rows twists, actuators, commands;
  bool accepted;
  std::string origin, worst_constraint;
  double max_violation;
  Summary summary;
};

template <int N>
Vector<N> vector_of(py::handle value, const std::string& what) {
  if (value.is_none()) return Vector<N>::Zero();
  const Batch x = batch(value, {N}, what);
  if (!x.single) throw py::value_error(what + ": expected one vector of shape (" + std::to_string(N) + ",)");
  return Eigen::Map<const Vector<N>>(x.data());
}

SE3 pose_of(py::handle value, const std::string& what) {
  if (!py::isinstance<Elements<SE3>>(value) || !value.cast<const Elements<SE3>&>().single)
    throw py::type_error(what + ": expected one SE3, not " +
                         std::string(py::str(py::type::of(value).attr("__name__"))));
  return value.cast<const Elements<SE3>&>()[0];
}

py::object py_pose(const SE3& pose) { return py::cast(Elements<SE3>{{pose}, true}); }

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

template <int N>
PyVehicleState step(const VehicleModel<N>& model, const Vehicle& vehicle, const PyVehicleState& from,
                    const Eigen::VectorXd& command, double dt, const Vector<3>& current) {
  if (!(dt > 0)) throw BadInputError("step: dt is " + std::to_string(dt) + " s; it must be positive");
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
      p.covariance.emplace_back(Eigen::Map<const Matrix<6, 6>>(S.data() + 36 * i));
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

PlanOptions plan_options(Options& read, const Vehicle& vehicle) {
  PlanOptions o;
  o.twist = Bounds<6>{-vehicle.most_twist, vehicle.most_twist};
  read("steps", o.steps);
  read("dt", o.dt);
  read("goal", o.goal);
  read("running_position", o.running_position);
  read("running_orientation", o.running_orientation);
  read("terminal_position", o.terminal_position);
  read("terminal_orientation", o.terminal_orientation);
  read("running_speed", o.running_speed);
  read("running_turn_rate", o.running_turn_rate);
  read("effort", o.effort);
  read("rate", o.rate);
  read("information", o.information);
  read("sight_range", o.sight.range);
  read("sight_half_angle", o.sight.half_angle);
  read("fix", o.fix);
  py::object twist;
  read("twist", twist);
  if (twist) {
    const PyBounds bounds = bounds_of(twist, "Planner: twist");
    const auto side = [&](const std::vector<double>& rows) {
      return Vector<6>(Eigen::Map<const Vector<6>>(bounds.expanded(rows, 6, "Planner: twist").data()));
    };
    o.twist = Bounds<6>{side(bounds.lower), side(bounds.upper)};
  }
  read("lowest", o.lowest);
  read("highest", o.highest);
  read("max_roll_pitch", o.max_roll_pitch);
  read("keep_out", o.keep_out);
  read("approach", o.approach);
  read("view", o.view);
  read("chance", o.chance);
  return o;
}

PlannerOptions planner_options(Options& read, const Vehicle& vehicle) {
  PlannerOptions o;
  o.pursuit = pursuit_limits(vehicle);
  if (!ipopt_available()) o.solver = PlanSolver::augmented_lagrangian;
  read("solver", o.solver, kPlanSolvers);
  read("refine", o.refine);
  read("deadline", o.deadline);
  read("max_iterations", o.max_iterations);
  read("max_warm_iterations", o.max_warm_iterations);
  read("max_warm_refinements", o.max_warm_refinements);
  return o;
}

/// A planner of a vehicle with 3 or 8 actuators.
class PyPlanner {
  /// Calls f with the planner. Throws BusyError if another thread uses it.
  template <class F>
  auto visit(F f) {
    return exclusive_.run([&] { return std::visit([&](auto& planner) { return f(*planner); }, planner_); });
  }

 public:
  PyPlanner(Vehicle vehicle, const py::kwargs& given) : vehicle_(std::move(vehicle)) {
    Options read("Planner", given);
    const PlanOptions plan = plan_options(read, vehicle_);
    const PlannerOptions options = planner_options(read, vehicle_);
    read.finish();
    steps_ = plan.steps;
    std::visit(
        [&]<int N>(const VehicleModel<N>& model) { planner_ = std::make_unique<Planner<N>>(model, plan, options); },
        vehicle_.model);
  }

  PyPlan replan(const PyVehicleState& start, const TargetPrediction& target, py::handle current) {
    const Vector<3> water = vector_of<3>(current, "replan: current");
    if (target.pose.size() != std::size_t(steps_) + 1)
      throw py::value_error("replan: the prediction of the target needs steps + 1 = " + std::to_string(steps_ + 1) +
                            " poses, not " + std::to_string(target.pose.size()));
    return visit([&]<int N>(Planner<N>& planner) {
      const VehicleState<N> from = with_idle<N>(start, vehicle_);
      WatchedSolve watched;
      return plan_of(watched.run([&] { return planner.replan(from, water, target); }));
    });
  }
  py::list active_constraints() {
    return visit([&](auto& planner) {
      py::list all;
      for (const ActiveConstraint& c : planner.active_constraints())
        all.append(py::dict(py::arg("constraint") = c.constraint, py::arg("value") = c.value,
                            py::arg("bound") = c.bound, py::arg("multiplier") = c.multiplier));
      return all;
    });
  }
  bool has_plan() const {
    return std::visit([](const auto& planner) { return planner->has_plan(); }, planner_);
  }
  void reset() {
    visit([](auto& planner) { planner.reset(); });
  }
  const Vehicle& vehicle() const { return vehicle_; }
  int steps() const { return steps_; }

 private:
  template <int N>
  PyPlan plan_of(const PlanResult<N>& result) const {
    const std::vector<VehicleState<N>>& states = result.plan.states;
    const auto n = Eigen::Index(states.size()), named = Eigen::Index(vehicle_.actuators.size());
    PyPlan plan{{{}, false},
                Rows(n, 6),
                Rows(n, named),
                Rows(n - 1, named),
                result.accepted(),
                std::string(name(result.origin)),
                result.worst_constraint,
                result.max_violation,
                result.summary};
    for (Eigen::Index i = 0; i < n; ++i) {
      const VehicleState<N>& state = states[std::size_t(i)];
      plan.poses.x.push_back(state.pose);
      plan.twists.row(i) = state.twist;
      plan.actuators.row(i) = state.actuators.head(named);
      if (i + 1 < n) plan.commands.row(i) = result.plan.commands[std::size_t(i)].head(named);
    }
    return plan;
  }

  Vehicle vehicle_;
  int steps_ = 0;
  std::variant<std::unique_ptr<Planner<3>>, std::unique_ptr<Planner<8>>> planner_;
  Exclusive exclusive_{"planner"};
};

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
  s.def_property_readonly("pose", [](const PyVehicleState& x) { return py_pose(x.pose); });
  s.def_property_readonly("twist", [](const PyVehicleState& x) { return x.twist; });
  s.def_property_readonly("actuators", [](const PyVehicleState& x) { return x.actuators; });
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
  t.def_property_readonly("poses", [](const TargetPrediction& x) { return Elements<SE3>{x.pose, false}; });
  t.def_property_readonly("twists", [](const TargetPrediction& x) {
    return map_vectors<6>(x.twist.size(), false, [&](std::size_t i) { return x.twist[i]; });
  });
  t.def_property_readonly("covariances", [](const TargetPrediction& x) {
    return map_matrices<6, 6>(x.covariance.size(), false, [&](std::size_t i) { return x.covariance[i]; });
  });
  t.def("__len__", [](const TargetPrediction& x) { return x.pose.size(); });
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
      ">>> import tandem\n"
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
      .def_readonly("half_angle", &Cone::half_angle)
      .def("__repr__", [](const Cone& x) { return "<Cone of half angle " + std::to_string(x.half_angle) + " rad>"; });
}

}  // namespace

void bind_planner(py::module_& m) {
  bind_vehicle(m);
  bind_prediction(m);

  py::class_<PyPlan> r(m, "PlanResult", "Result of Planner.replan: H commands and the H + 1 states that they lead to.");
  r.def_property_readonly(
      "poses", [](const PyPlan& x) { return x.poses; }, "Poses, an array of H + 1 SE3.");
  r.def_property_readonly(
      "twists", [](const PyPlan& x) { return x.twists; }, "Body twists, shape (H + 1, 6).");
  r.def_property_readonly(
      "actuators", [](const PyPlan& x) { return x.actuators; }, "Actuator states, shape (H + 1, n).");
  r.def_property_readonly(
      "commands", [](const PyPlan& x) { return x.commands; }, "Commands, shape (H, n).");
  r.def_readonly("accepted", &PyPlan::accepted, "Whether the plan meets the hard constraints and can be executed.");
  r.def_readonly("origin", &PyPlan::origin,
                 "\"solved\", \"stopped\" at a feasible point, or \"shifted\": the last plan, if none is feasible.");
  r.def_readonly("max_violation", &PyPlan::max_violation, "Largest violation of the hard constraints.");
  r.def_readonly("worst_constraint", &PyPlan::worst_constraint, "The most violated constraint, or an empty text.");
  r.def_readonly("summary", &PyPlan::summary, "SolveSummary of the last solve.");
  r.def("__repr__", [](const PyPlan& x) {
    return "<PlanResult: " + x.origin + ", " + std::to_string(x.commands.rows()) + " steps" +
           (x.accepted ? ">" : ", not accepted: " + x.worst_constraint + ">");
  });

  py::class_<PyPlanner> c(
      m, "Planner",
      "Receding-horizon planner of a chaser relative to a predicted target. Each plan starts from the last one.\n\n"
      "Planner(vehicle, **options)\n\n"
      "Args:\n"
      "    vehicle: a Vehicle.\n"
      "    options: those of the C++ structs PlanOptions and PlannerOptions, with SI units and radians: steps, dt, "
      "goal "
      "(SE3, chaser in the target's frame), costs as standard deviations (running_position, running_orientation, "
      "terminal_position, terminal_orientation, running_speed, running_turn_rate, effort, rate), information, "
      "sight_range, sight_half_angle, fix; hard constraints: twist (bounds), lowest, highest, max_roll_pitch, "
      "keep_out, "
      "approach and view (Cone), chance; solver (ipopt, augmented-lagrangian, nlopt:slsqp), refine, deadline, "
      "max_iterations, max_warm_iterations, max_warm_refinements.\n\n"
      ">>> import tandem\n"
      ">>> remus = tandem.Vehicle('remus_100')\n"
      ">>> planner = tandem.Planner(remus, steps=10, dt=1.0, goal=tandem.SE3.exp([-6, 0, 0, 0, 0, 0]))\n"
      ">>> before, now = tandem.SE3.exp([[29, 0, 0, 0, 0, 0], [30, 0, 0, 0, 0, 0]])\n"
      ">>> target = tandem.predict_target(before, now, 1.0, noise=np.full(6, 0.01), step=1.0, steps=10)\n"
      ">>> plan = planner.replan(tandem.VehicleState(tandem.SE3(), [1.5, 0, 0, 0, 0, 0]), target)\n"
      ">>> plan.accepted, plan.commands.shape\n"
      "(True, (10, 3))\n");
  c.def(py::init<Vehicle, const py::kwargs&>(), py::arg("vehicle"));
  c.def("replan", &PyPlanner::replan, py::arg("start"), py::arg("target"), py::arg("current") = py::none(),
        "replan(start, target, current=(0, 0, 0))\n\nReturn the next plan from a VehicleState against a "
        "TargetPrediction with H + 1 poses, in a water current [m/s] along the world axes. If no plan is feasible, "
        "returns the last accepted plan, shifted; without one, the best point, which is not accepted.");
  c.def("active_constraints", &PyPlanner::active_constraints,
        "active_constraints()\n\nReturn the active inequalities of the last plan: dictionaries with constraint, value, "
        "bound and multiplier.");
  c.def("reset", &PyPlanner::reset, "reset()\n\nDiscard the last plan.");
  c.def_property_readonly("has_plan", &PyPlanner::has_plan, "Whether the next plan starts from a previous one.");
  c.def_property_readonly("vehicle", &PyPlanner::vehicle, py::return_value_policy::copy);
  c.def_property_readonly("steps", &PyPlanner::steps, "Number of steps H.");
  c.def("__repr__", [](const PyPlanner& x) {
    return "<Planner of " + x.vehicle().name + ": " + std::to_string(x.steps()) + " steps>";
  });
}

}  // namespace tandem::python
