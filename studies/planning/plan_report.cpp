#include <algorithm>
#include <map>

#include <fmt/format.h>

#include <tandem/residuals/roll_pitch.hpp>
#include <tandem/studies/planning/plan_report.hpp>
#include <tandem/studies/support/json_fields.hpp>
#include <tandem/studies/support/text.hpp>
#include <tandem/studies/support/units.hpp>

namespace tandem {
namespace {

double min_distance(const PlannedRun& run) {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t k = 1; k < run.instants.size(); ++k)
    least = std::min(least, (run.instants[k].chaser.translation() - run.instants[k].target.translation()).norm());
  return least;
}

/// Returns the name of a constraint without its step: "prior of command" for "prior of command at step 3".
std::string kind(const std::string& constraint) { return constraint.substr(0, constraint.find(" at step ")); }

std::map<std::string, int> count_by_kind(const std::vector<ActiveConstraint>& active) {
  std::map<std::string, int> count;
  for (const ActiveConstraint& a : active) ++count[kind(a.constraint)];
  return count;
}

/// Returns a limit as the user gave it, with its current value.
std::string limit_text(PlanLimit limit, const PlannedRun& run) {
  const PlanOptions& o = run.request.plan;
  const SE3 &chaser = run.start.chaser, &target = run.start.target.now;
  const auto off_axis = [](const Cone& cone, const SE3& carrier, const SE3& other) {
    const Vector<3> p = (carrier * cone.apex).inverse().act(other.act(cone.point));
    return fmt::format("{:.3g}° (now {:.3g}°)", kDegrees * cone.half_angle,
                       kDegrees * std::atan2(p.tail<2>().norm(), p.x()));
  };
  switch (limit) {
    case PlanLimit::commands:
      return fmt::format("the actuator ranges of {}", run.vehicle.name);
    case PlanLimit::twist:
      break;
    case PlanLimit::depth:
      return fmt::format("--depth {:g},{:g} (now {:.2f} m)", -o.highest.value_or(HUGE_VAL),
                         -o.lowest.value_or(-HUGE_VAL), -chaser.translation().z());
    case PlanLimit::roll_pitch: {
      Vector<2> r;
      RollPitch<>{}(chaser, r);
      return fmt::format("--most-roll-pitch {:g} (now {:.2g}° and {:.2g}°)", kDegrees * *o.max_roll_pitch,
                         kDegrees * r[0], kDegrees * r[1]);
    }
    case PlanLimit::keep_out:
      return fmt::format("--keep-out {:g} (now {:.2f} m)", o.keep_out,
                         (chaser.translation() - target.translation()).norm());
    case PlanLimit::approach:
      return "--approach " + off_axis(*o.approach, target, chaser);
    case PlanLimit::view:
      return "--view " + off_axis(*o.view, chaser, target);
  }
  return fmt::format("most_twist of {} (now {:.2f} m/s and {:.2f} rad/s)", run.vehicle.name,
                     run.start.chaser_twist.head<3>().norm(), run.start.chaser_twist.tail<3>().norm());
}

/// Returns 3 σ of the position, the largest of the three axes [m].
double three_sigma(const Matrix<6, 6>& covariance) {
  return 3.0 * std::sqrt(covariance.diagonal().head<3>().maxCoeff());
}

JsonFields<MissAtEnd> miss_fields() {
  using M = MissAtEnd;
  return JsonFields<M>()
      .add("position_m", "distance from the goal position [m]", [](const M& m) { return m.position; })
      .add("orientation_deg", "angle from the goal orientation [deg]",
           [](const M& m) { return kDegrees * m.orientation; })
      .add("speed_m_s", "speed relative to the target [m/s]", [](const M& m) { return m.speed; });
}

JsonFields<DiscretisationError> discretisation_fields() {
  using E = DiscretisationError;
  return JsonFields<E>()
      .add("position_m", "largest difference in position [m]", [](const E& e) { return e.position; })
      .add("heading_deg", "largest difference in heading [deg]", [](const E& e) { return kDegrees * e.heading; });
}

JsonFields<PlannedRun> three_sigma_fields() {
  using R = PlannedRun;
  return JsonFields<R>()
      .add("start", "at the time of the plan",
           [](const R& r) { return three_sigma(r.instants.front().target_covariance); })
      .add("end", "at the end of the plan", [](const R& r) { return three_sigma(r.instants.back().target_covariance); })
      .add("end_with_fixes", "at the end, if the expected fixes are received",
           [](const R& r) { return three_sigma(r.instants.back().target_covariance_with_fixes); });
}

std::vector<std::string> conflicting_limits(const PlannedRun& run) {
  std::vector<std::string> texts;
  for (const PlanLimit limit : run.conflict) texts.push_back(limit_text(limit, run));
  return texts;
}

/// Returns sentences about problems of the plan that its status does not show.
std::vector<std::string> warnings(const PlannedRun& run) {
  constexpr double kFar = 5, kTurned = 20;  // m and °: a controller cannot be expected to follow such a plan
  const DiscretisationError& error = run.discretisation;
  if (error.position <= kFar && kDegrees * error.heading <= kTurned) return {};
  return {fmt::format(
      "in continuous time, the commands move the vehicle up to {:.1f} m and {:.0f}° away from the plan, because the "
      "steps of {:g} s are long for its motion; use a shorter --step, or replan often",
      error.position, kDegrees * error.heading, run.request.plan.dt)};
}

JsonFields<PlannedRun> plan_fields() {
  using R = PlannedRun;
  return JsonFields<R>()
      .add("scenario", "name of the scenario", [](const R& r) { return r.scenario; })
      .add("frame", "frame of the scenario: ENU-FLU or NED-FRD", [](const R& r) { return r.frame.name(); })
      .add("vehicle", "name of the vehicle", [](const R& r) { return r.vehicle.name; })
      .add("at", "time of the plan [s]", [](const R& r) { return r.start.t; })
      .add("steps", "number of steps", [](const R& r) { return r.request.plan.steps; })
      .add("step", "time step [s]", [](const R& r) { return r.request.plan.dt; })
      .add("solver", "name of the solver", [](const R& r) { return r.summary.solver; })
      .add("status", "converged, or why the solve ended", [](const R& r) { return name(r.summary.status); })
      .add("message", "explanation of the status", [](const R& r) { return r.summary.message; })
      .add("origin", "origin of the plan: solved, stopped or shifted", [](const R& r) { return name(r.origin); })
      .add("coupled", "whether estimate and plan were solved as one program", [](const R& r) { return r.coupled; })
      .add("accepted", "whether the plan satisfies all hard constraints", [](const R& r) { return r.accepted(); })
      .add("cost", "final cost", [](const R& r) { return r.summary.cost; })
      .add("max_violation", "largest violation of a hard constraint, in its own unit",
           [](const R& r) { return r.max_violation; })
      .add("worst_constraint", "the constraint with that violation",
           [](const R& r) { return r.worst_constraint.empty() ? std::nullopt : std::optional(r.worst_constraint); })
      .add("conflicting_limits", "limits that contradict each other or the current state", conflicting_limits)
      .add("iterations", "number of iterations", [](const R& r) { return r.summary.iterations; })
      .add("seconds", "duration of the solve [s]", [](const R& r) { return r.summary.seconds; })
      .add_object("end", "difference from the goal at the end", miss_fields(),
                  [](const R& r) { return miss_at_end(r); })
      .add("min_distance_m", "minimum distance between chaser and target [m]",
           [](const R& r) { return min_distance(r); })
      .add_object("discretisation_error",
                  "difference between the plan and the motion in continuous time under its commands, without feedback",
                  discretisation_fields(), [](const R& r) { return r.discretisation; })
      .add_object("target_three_sigma_m", "3σ bound of the target's predicted position, largest of the axes [m]",
                  three_sigma_fields(), [](const R& r) -> const R& { return r; })
      .add("active_constraints", "number of active rows by constraint",
           [](const R& r) { return count_by_kind(r.active); })
      .add("warnings", "problems of the plan that its status does not show", warnings);
}

}  // namespace

std::string report(const PlannedRun& run) {
  const PlanOptions& o = run.request.plan;
  const MissAtEnd miss = miss_at_end(run);
  std::string text = fmt::format("{}: {} from {:.3f} s, {} steps of {:g} s\n", run.scenario, run.vehicle.name,
                                 run.start.t, o.steps, o.dt);
  text += fmt::format("{}{}: {}, {} iterations in {:.1f} ms, cost {:.4f}, violation {:.1e}\n", run.summary.solver,
                      run.coupled ? ", coupled" : "", name(run.origin), run.summary.iterations,
                      1e3 * run.summary.seconds, run.summary.cost, run.max_violation);
  text += fmt::format("at the end        {:.2f} m and {:.1f}° from the goal, relative speed {:.2f} m/s\n",
                      miss.position, kDegrees * miss.orientation, miss.speed);
  text += fmt::format("minimum distance  {:.2f} m\n", min_distance(run));
  text += fmt::format("discretisation    up to {:.2f} m and {:.1f}° from the motion in continuous time, open loop\n",
                      run.discretisation.position, kDegrees * run.discretisation.heading);
  text += fmt::format("target, 3 σ       {:.2f} m now, {:.2f} m at the end, {:.2f} m with the expected fixes\n",
                      three_sigma(run.instants.front().target_covariance),
                      three_sigma(run.instants.back().target_covariance),
                      three_sigma(run.instants.back().target_covariance_with_fixes));
  if (run.active.empty()) text += "active bounds     none\n";
  for (const auto& [constraint, count] : count_by_kind(run.active))
    text += fmt::format("active bounds     {} × {}\n", count, constraint);
  for (const std::string& warning : warnings(run)) text += "WARNING: " + warning + ".\n";
  return text;
}

std::string plan_json(const PlannedRun& run) { return json_text(json_document("plan", plan_fields(), run)); }

FileDescription plan_json_keys() { return describe_json("summary.json", "plan", plan_fields()); }

std::string why_not_accepted(const PlannedRun& run) {
  if (run.accepted()) return "";
  if (run.summary.status == Status::unsupported) return fmt::format("no plan was computed: {}", run.summary.message);
  const std::string found = fmt::format("{}: {}; largest violation: {}, by {:.2g}", run.summary.solver,
                                        run.summary.message, run.worst_constraint, run.max_violation);
  if (run.conflict.empty()) return fmt::format("no plan meets the hard constraints ({})", found);
  std::vector<std::string> conflict;
  for (const PlanLimit limit : run.conflict) conflict.push_back(limit_text(limit, run));
  const bool one = conflict.size() == 1;
  return fmt::format(
      "no plan meets the hard constraints: {}; relax {} ({})",
      one ? conflict.front() + " cannot be met from the current state" : listed(conflict) + " contradict each other",
      one ? "it" : "one of them", found);
}

}  // namespace tandem
