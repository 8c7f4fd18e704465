#include <algorithm>
#include <map>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <tandem/residuals/roll_pitch.hpp>
#include <tandem/studies/planning/plan_report.hpp>
#include <tandem/studies/support/json_text.hpp>
#include <tandem/studies/support/text.hpp>
#include <tandem/studies/support/units.hpp>

namespace tandem {
namespace {

using Json = nlohmann::ordered_json;

double least_distance(const PlannedRun& run) {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t k = 1; k < run.instants.size(); ++k)
    least = std::min(least, (run.instants[k].chaser.translation() - run.instants[k].target.translation()).norm());
  return least;
}

/// "prior of command at step 3" is one of "prior of command".
std::string kind(const std::string& constraint) { return constraint.substr(0, constraint.find(" at step ")); }

std::map<std::string, int> count_by_kind(const std::vector<ActiveConstraint>& active) {
  std::map<std::string, int> count;
  for (const ActiveConstraint& a : active) ++count[kind(a.constraint)];
  return count;
}

/// What was asked for, and where the chaser is now.
std::string described(PlanLimit limit, const PlannedRun& run) {
  const PlanOptions& o = run.request.plan;
  const SE3 &chaser = run.start.chaser, &target = run.start.target.now;
  const auto off_axis = [](const Cone& cone, const SE3& carrier, const SE3& other) {
    const Vector<3> p = (carrier * cone.apex).inverse().act(other.act(cone.point));
    return fmt::format("{:.3g}° (now {:.3g}°)", kDegrees * cone.half_angle,
                       kDegrees * std::atan2(p.tail<2>().norm(), p.x()));
  };
  switch (limit) {
    case PlanLimit::commands:
      return fmt::format("the ranges of {}'s actuators", run.vehicle.name);
    case PlanLimit::twist:
      break;
    case PlanLimit::depth:
      return fmt::format("--depth {:g},{:g} (now {:.2f} m)", -o.highest.value_or(HUGE_VAL),
                         -o.lowest.value_or(-HUGE_VAL), -chaser.translation().z());
    case PlanLimit::roll_pitch: {
      Vector<2> r;
      RollPitch<>{}(chaser, r);
      return fmt::format("--most-roll-pitch {:g} (now {:.2g}° and {:.2g}°)", kDegrees * *o.most_roll_pitch,
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
  return fmt::format("{}'s most_twist (now {:.2f} m/s and {:.2f} rad/s)", run.vehicle.name,
                     run.start.chaser_twist.head<3>().norm(), run.start.chaser_twist.tail<3>().norm());
}

/// Position [m], largest of three axes.
double three_sigma(const Matrix<6, 6>& covariance) {
  return 3.0 * std::sqrt(covariance.diagonal().head<3>().maxCoeff());
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
  text += fmt::format("at the end        {:.2f} m and {:.1f}° from the goal, at {:.2f} m/s along with it\n",
                      miss.position, kDegrees * miss.orientation, miss.speed);
  text += fmt::format("least distance    {:.2f} m\n", least_distance(run));
  text += fmt::format("target, 3 σ       {:.2f} m now, {:.2f} m at the end, {:.2f} m by what is seen until then\n",
                      three_sigma(run.instants.front().target_covariance),
                      three_sigma(run.instants.back().target_covariance), three_sigma(run.instants.back().with_fixes));
  if (run.active.empty()) return text + "no bound is touched\n";
  for (const auto& [constraint, count] : count_by_kind(run.active))
    text += fmt::format("at its bound      {} × {}\n", count, constraint);
  return text;
}

std::string plan_json(const PlannedRun& run) {
  const MissAtEnd miss = miss_at_end(run);
  Json json;
  json["scenario"] = run.scenario;
  json["frame"] = run.frame.name();
  json["vehicle"] = run.vehicle.name;
  json["at"] = run.start.t;
  json["steps"] = run.request.plan.steps;
  json["step"] = run.request.plan.dt;
  json["solver"] = run.summary.solver;
  json["status"] = name(run.summary.status);
  json["message"] = run.summary.message;
  json["origin"] = name(run.origin);
  json["coupled"] = run.coupled;
  json["accepted"] = run.accepted();
  json["cost"] = run.summary.cost;
  json["max_violation"] = run.max_violation;
  if (!run.worst_constraint.empty()) json["worst_constraint"] = run.worst_constraint;
  for (const PlanLimit limit : run.clash) json["clash"].push_back(described(limit, run));
  json["iterations"] = run.summary.iterations;
  json["seconds"] = run.summary.seconds;
  json["end"] = {
      {"position_m", miss.position}, {"orientation_deg", kDegrees * miss.orientation}, {"speed_m_s", miss.speed}};
  json["least_distance_m"] = least_distance(run);
  json["target_three_sigma_m"] = {{"start", three_sigma(run.instants.front().target_covariance)},
                                  {"end", three_sigma(run.instants.back().target_covariance)},
                                  {"end_with_fixes", three_sigma(run.instants.back().with_fixes)}};
  json["active_constraints"] = count_by_kind(run.active);
  return json_text(json);
}

std::string why_not_accepted(const PlannedRun& run) {
  if (run.accepted()) return "";
  if (run.summary.status == Status::unsupported) return fmt::format("nothing was planned: {}", run.summary.message);
  const std::string found = fmt::format("{}: {}; the worst is {}, by {:.2g}", run.summary.solver, run.summary.message,
                                        run.worst_constraint, run.max_violation);
  if (run.clash.empty()) return fmt::format("no plan meets the hard constraints ({})", found);
  std::vector<std::string> clash;
  for (const PlanLimit limit : run.clash) clash.push_back(described(limit, run));
  const bool one = clash.size() == 1;
  return fmt::format("no plan meets the hard constraints: {}; widen {} ({})",
                     one ? clash.front() + " cannot be kept from here" : listed(clash) + " clash",
                     one ? "it" : "one of them", found);
}

}  // namespace tandem
