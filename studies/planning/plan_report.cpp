#include <algorithm>
#include <map>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <tandem/studies/planning/plan_report.hpp>
#include <tandem/studies/support/json_text.hpp>
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
                      miss.position, kDegrees * miss.attitude, miss.speed);
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
  json["iterations"] = run.summary.iterations;
  json["seconds"] = run.summary.seconds;
  json["end"] = {{"position_m", miss.position}, {"attitude_deg", kDegrees * miss.attitude}, {"speed_m_s", miss.speed}};
  json["least_distance_m"] = least_distance(run);
  json["target_three_sigma_m"] = {{"start", three_sigma(run.instants.front().target_covariance)},
                                  {"end", three_sigma(run.instants.back().target_covariance)},
                                  {"end_with_fixes", three_sigma(run.instants.back().with_fixes)}};
  json["active_constraints"] = count_by_kind(run.active);
  return json_text(json);
}

std::string why_not_accepted(const PlannedRun& run) {
  if (run.accepted()) return "";
  return fmt::format("no plan meets the hard constraints ({}: {}); the worst is {}, by {:.2g}", run.summary.solver,
                     run.summary.message, run.worst_constraint, run.max_violation);
}

}  // namespace tandem
