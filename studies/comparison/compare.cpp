#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <tandem/lie/error.hpp>
#include <tandem/problem/navigation/trajectory.hpp>
#include <tandem/problem/tracking/planar.hpp>
#include <tandem/studies/comparison/compare.hpp>
#include <tandem/studies/support/installation.hpp>
#include <tandem/studies/support/option_values.hpp>
#include <tandem/studies/support/subprocess.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kPointsPerDecade = 50;

/// Records the progress of a solve, with points evenly spaced in the logarithm of time.
class Curve {
 public:
  void add(const Progress& p) {
    if (!points.empty() && p.seconds < next_) return;
    add(CurvePoint{p.seconds, p.cost, p.violation});
    next_ = p.seconds * std::pow(10.0, 1.0 / kPointsPerDecade);
  }
  /// Ignores points that are not finite, which occur where a residual is undefined.
  void add(const CurvePoint& p) {
    if (std::isfinite(p.cost) && std::isfinite(p.violation)) points.push_back(p);
  }
  std::vector<CurvePoint> points;

 private:
  double next_ = 0;
};

/// Sets the mean errors over the keyframes that the truth covers.
void compare_with_truth(const Scenario& scenario, const TrackingProblem& tracking, ComparedSolve& solve) {
  std::vector<SE3> chaser;
  std::vector<TargetState> target;
  double headings = 0;
  int n = 0;
  for (std::size_t k = 0; k < tracking.keyframes.size(); ++k) {
    chaser.push_back(tracking.chaser_pose(k));
    target.push_back(tracking.target_state(k));
    const double t = tracking.keyframes[k].t;
    const auto true_chaser = pose_at(scenario.truth_chaser, t), true_target = pose_at(scenario.truth_target, t);
    if (!true_chaser || !true_target || !scenario.truth_orientation || !target.back().rotation) continue;
    const SO3 estimated = chaser.back().rotation().inverse() * *target.back().rotation;
    const SO3 truth = true_chaser->rotation().inverse() * true_target->rotation();
    headings += std::abs(heading(estimated.inverse() * truth));
    ++n;
  }
  if (n > 0) solve.heading = headings / n * 180.0 / std::numbers::pi;
  if (const auto position = summarise(keyframe_errors(scenario, tracking.keyframes, chaser, target)).position)
    solve.position = position->mean;
}

void fill(const Summary& summary, ComparedSolve& solve) {
  solve.status = name(summary.status);
  solve.message = summary.message;
  solve.solved = summary.status != Status::unsupported;
  solve.initial_cost = summary.initial_cost;
  solve.cost = summary.cost;
  solve.iterations = summary.iterations;
  solve.evaluations = summary.evaluations;
  solve.seconds = summary.seconds;
}

/// Reads a number; null, which JSON has for numbers that are not finite, gives NaN.
double number(const Json& json) { return json.is_number() ? json.get<double>() : std::nan(""); }
std::optional<double> optional_number(const Json& json, const char* key) {
  return json.contains(key) ? std::optional(number(json[key])) : std::nullopt;
}

}  // namespace

std::vector<NamedSolver> available_solvers() {
  std::vector<NamedSolver> all = {{"gauss-newton", GaussNewtonOptions{}},
                                  {"augmented-lagrangian", AugmentedLagrangianOptions{}},
                                  {"ipopt", IpoptOptions{}}};
  for (const char* hessian : {"gauss-newton", "exact", "limited-memory"}) {
    IpoptOptions options;
    options.hessian = parse_hessian("--hessian", hessian);
    all.push_back({fmt::format("ipopt:{}", hessian), options});
  }
  for (const std::string& algorithm : nlopt_algorithms()) {
    NloptOptions options;
    options.algorithm = algorithm;
    all.push_back({"nlopt:" + algorithm, options, algorithm == "slsqp" || algorithm.starts_with("auglag")});
  }
  return all;
}

std::vector<NamedSolver> parse_solver_list(const std::string& option, const std::string& text) {
  const std::vector<NamedSolver> all = available_solvers();
  std::vector<NamedSolver> chosen;
  std::vector<std::string> known = {"all", "nlopt"};
  for (const NamedSolver& contender : all) known.push_back(contender.name);
  const auto is_chosen = [&](const std::string& name) {
    return std::any_of(chosen.begin(), chosen.end(), [&](const NamedSolver& c) { return c.name == name; });
  };
  for (const std::string_view word : split(text, ',')) {
    bool found = false;
    for (const NamedSolver& contender : all) {
      if (word != "all" && word != contender.name && !(word == "nlopt" && contender.name.starts_with("nlopt:")))
        continue;
      found = true;
      if (!is_chosen(contender.name)) chosen.push_back(contender);
    }
    if (!found && word.starts_with("nlopt") && nlopt_algorithms().empty())
      throw Error(fmt::format("{} {}: this build has no NLopt; install it and configure again", option, word));
    if (!found)
      throw Error(fmt::format("{}: unknown solver {}{} (available: {})", option, quote(word), did_you_mean(word, known),
                              listed(known)));
  }
  return chosen;
}

std::vector<Role> parse_constraints(const std::string& option, const std::string& text) {
  std::vector<Role> roles;
  for (const std::string_view word : split(text, ',')) {
    std::optional<Role> found;
    for (const Role role : {Role::off, Role::soft, Role::hard})
      if (word == constraints_name(role)) found = role;
    if (!found)
      throw Error(fmt::format("{} takes a comma-separated list of off, soft and hard, not {}{}", option, quote(word),
                              did_you_mean(word, {"off", "soft", "hard"})));
    if (std::find(roles.begin(), roles.end(), *found) == roles.end()) roles.push_back(*found);
  }
  return roles;
}

std::string_view constraints_name(Role role) {
  return role == Role::off ? "off" : role == Role::soft ? "soft" : "hard";
}

ComparedSolve run_compared_solve(const Scenario& scenario, const ComparedProblem& compared,
                                 const NamedSolver& contender) {
  TrackingProblem tracking =
      make_tracking_problem(scenario.data, with_constraints(compared.tracking, compared.constraints, compared.role));
  ComparedSolve result;
  result.solver = contender.name;
  result.role = compared.role;
  result.keyframes = tracking.keyframes.size();
  Curve curve;
  try {
    AnySolver solver = contender.solver;
    const Summary summary = std::visit(
        [&](auto& options) {
          const auto also = options.progress;
          options.progress = [&curve, also](const Progress& p) {
            curve.add(p);
            if (also) also(p);
          };
          options.time_limit = compared.time_limit;
          return solve(tracking.problem, options);
        },
        solver);
    fill(summary, result);
    result.solved = result.solved && std::isfinite(result.cost);  // otherwise the message explains the failure
    if (!result.solved) return result;
    const ConstraintCheck outside = check(tracking, scenario.data.noise, compared.constraints);
    result.violation = outside.violation;
    if (compared.role == Role::soft) result.constraint_cost = outside.cost;
    compare_with_truth(scenario, tracking, result);
    curve.add(CurvePoint{summary.seconds, summary.cost, summary.max_violation});
    result.curve = std::move(curve.points);
  } catch (const std::exception& error) {
    result.status = name(Status::failed);
    result.message = error.what();
    result.solved = false;
  }
  return result;
}

std::string to_text(const ComparedSolve& s) {
  Json json = {{"solver", s.solver},
               {"role", constraints_name(s.role)},
               {"keyframes", s.keyframes},
               {"status", s.status},
               {"message", s.message},
               {"solved", s.solved},
               {"numbers", {s.initial_cost, s.cost, s.constraint_cost, s.violation, s.seconds}},
               {"iterations", s.iterations},
               {"evaluations", s.evaluations}};
  if (s.position) json["position"] = *s.position;
  if (s.heading) json["heading"] = *s.heading;
  for (const CurvePoint& p : s.curve) json["curve"].push_back({p.seconds, p.cost, p.violation});
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

ComparedSolve parse_compared_solve(const std::string& text) {
  ComparedSolve s;
  const Json json = Json::parse(text);
  s.solver = json["solver"];
  s.role = parse_constraints("role", json["role"]).front();
  s.keyframes = json["keyframes"];
  s.status = json["status"];
  s.message = json["message"];
  s.solved = json["solved"];
  double* const numbers[] = {&s.initial_cost, &s.cost, &s.constraint_cost, &s.violation, &s.seconds};
  for (std::size_t i = 0; i < std::size(numbers); ++i) *numbers[i] = number(json["numbers"][i]);
  s.iterations = json["iterations"];
  s.evaluations = json["evaluations"];
  s.position = optional_number(json, "position");
  s.heading = optional_number(json, "heading");
  if (json.contains("curve"))
    for (const Json& p : json["curve"]) s.curve.push_back({number(p[0]), number(p[1]), number(p[2])});
  return s;
}

ComparedSolve compare_in_subprocess(std::vector<std::string> arguments, const NamedSolver& contender, Role role,
                                    double seconds, const std::atomic<bool>& stop) {
  const SubprocessRun run = run_subprocess(executable_path().string(), std::move(arguments), seconds, stop);
  ComparedSolve result;
  if (run.failure.empty()) {
    result = parse_compared_solve(run.output);
  } else {
    result.solver = contender.name;
    result.role = role;
    result.status = run.stopped ? name(Status::interrupted) : "crashed";
    result.message = run.failure;
  }
  result.peak_memory = run.peak_memory;
  return result;
}

}  // namespace tandem
