#include <variant>

#include <tandem/solvers/option_fields.hpp>
#include <tandem/solvers/replanning/planner.hpp>

#include "exclusive.hpp"
#include "noise.hpp"
#include "options.hpp"
#include "plan_inputs.hpp"
#include "problem_object.hpp"
#include "summary.hpp"
#include "watched_solve.hpp"

namespace tandem::python {
namespace {

using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// A plan with its named actuators.
struct PyPlan {
  Elements<SE3> poses;
  Rows twists, actuators, commands;
  bool accepted;
  std::string origin, worst_constraint;
  double max_violation;
  PySummary summary;
};

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
    bounds.check(6, 1, "Planner: twist");
    const auto side = [&](const RowBounds& rows) {
      return Vector<6>(Eigen::Map<const Vector<6>>(PyBounds::rows(rows, 0, 6).data()));
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
  std::vector<NamedValue<PlanSolver>> solvers;
  for (const PlanSolver solver : {PlanSolver::ipopt, PlanSolver::augmented_lagrangian, PlanSolver::slsqp})
    solvers.push_back({name(solver).data(), solver});
  read("solver", o.solver, solvers);
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
                PySummary(result.summary)};
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

}  // namespace

void bind_planner(py::module_& m) {
  bind_plan_inputs(m);

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
  r.def(py::pickle(
      [](const PyPlan& x) {
        return py::make_tuple(x.poses, x.twists, x.actuators, x.commands, x.accepted, x.origin, x.worst_constraint,
                              x.max_violation, x.summary);
      },
      [](const py::tuple& t) {
        return PyPlan{t[0].cast<Elements<SE3>>(), t[1].cast<Rows>(),        t[2].cast<Rows>(),
                      t[3].cast<Rows>(),          t[4].cast<bool>(),        t[5].cast<std::string>(),
                      t[6].cast<std::string>(),   t[7].cast<double>(),      t[8].cast<PySummary>()};
      }));
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
      "goal (SE3, chaser in the target's frame), costs as standard deviations (running_position, running_orientation, "
      "terminal_position, terminal_orientation, running_speed, running_turn_rate, effort, rate), information, "
      "sight_range, sight_half_angle, fix; hard constraints: twist (bounds), lowest, highest, max_roll_pitch, "
      "keep_out, approach and view (Cone), chance; solver (ipopt, augmented-lagrangian, nlopt:slsqp), refine, "
      "deadline, max_iterations, max_warm_iterations, max_warm_refinements.\n\n"
      ">>> import tandem, numpy as np\n"
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
  c.def_property_readonly("vehicle", &PyPlanner::vehicle, py::return_value_policy::copy, "Vehicle of the plans.");
  c.def_property_readonly("steps", &PyPlanner::steps, "Number of steps H.");
  c.def("__repr__", [](const PyPlanner& x) {
    return "<Planner of " + x.vehicle().name + ": " + std::to_string(x.steps()) + " steps>";
  });
}

}  // namespace tandem::python
