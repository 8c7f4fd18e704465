#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <tandem/studies/planning/rendezvous_study.hpp>
#include <tandem/studies/support/json_text.hpp>
#include <tandem/studies/support/output_file.hpp>
#include <tandem/studies/support/statistics.hpp>
#include <tandem/studies/support/text_table.hpp>

namespace tandem {
namespace {

using StudyJson = nlohmann::ordered_json;

std::vector<double> solve_milliseconds(const RendezvousRun& run) {
  std::vector<double> ms = solve_seconds(run);
  for (double& t : ms) t *= 1e3;
  return ms;
}

/// What is told of a method.
struct MethodFigures {
  int runs = 0, docked = 0, plans = 0, not_accepted = 0, shifted = 0, keep_out_violations = 0;
  double seconds = 0, miss = 0, effort = 0, three_sigma = 0;  ///< median of those that docked; medians of all
  double keep_out = 0, violation = 0;                         ///< worst
  double solve_median = 0, solve_99 = 0, first_99 = 0;        ///< ms
  Interval rate{};
};

MethodFigures figures(const std::vector<RendezvousRun>& runs) {
  MethodFigures f;
  std::vector<double> seconds, miss, effort, sigma, ms, first;
  for (const RendezvousRun& run : runs) {
    ++f.runs;
    if (run.outcome == RendezvousOutcome::docked) {
      ++f.docked;
      seconds.push_back(run.seconds);
    }
    miss.push_back(run.least_miss);
    effort.push_back(run.effort);
    if (run.three_sigma) sigma.push_back(*run.three_sigma);
    f.plans += run.plans;
    f.not_accepted += run.not_accepted;
    f.shifted += run.shifted;
    f.keep_out_violations += run.keep_out_violation > 0;
    f.keep_out = std::max(f.keep_out, run.keep_out_violation);
    f.violation = std::max(f.violation, run.worst_violation);
    const std::vector<double> of_run = solve_milliseconds(run);
    ms.insert(ms.end(), of_run.begin(), of_run.end());
    for (const RendezvousStep& step : run.steps)
      if (step.first) first.push_back(1e3 * step.processor_seconds);
  }
  f.seconds = quantile_of(seconds, 0.5);
  f.miss = quantile_of(miss, 0.5);
  f.effort = quantile_of(effort, 0.5);
  f.three_sigma = quantile_of(sigma, 0.5);
  f.solve_median = quantile_of(ms, 0.5);
  f.solve_99 = quantile_of(ms, 0.99);
  f.first_99 = quantile_of(first, 0.99);
  f.rate = share_interval(std::size_t(f.docked), std::size_t(f.runs)).value_or(Interval{0.0, 0.0, 1.0, 0});
  return f;
}

std::string shown(double value, int decimals) {
  return std::isfinite(value) ? fmt::format("{:.{}f}", value, decimals) : "–";
}

StudyJson json_of(double value) { return std::isfinite(value) ? StudyJson(value) : StudyJson(); }

struct RunRow {
  RendezvousMethod method;
  const RendezvousRun& run;

  /// Of what its plans took [ms]; nothing where it made none.
  std::optional<double> solve_quantile(double q) const {
    const std::vector<double> times = solve_milliseconds(run);
    return times.empty() ? std::nullopt : std::optional(quantile_of(times, q));
  }
};

CsvTable<RunRow> run_columns() {
  return CsvTable<RunRow>()
      .add("method", "decoupled, information, coupled or pursuit", [](const RunRow& r) { return name(r.method); })
      .add("seed", "of all noise", [](const RunRow& r) { return r.run.seed; })
      .add("outcome", "docked, failed or timed-out", [](const RunRow& r) { return name(r.run.outcome); })
      .add("why", "in a word, where it did not dock", [](const RunRow& r) { return r.run.why; })
      .add("seconds", "until then [s]", [](const RunRow& r) { return r.run.seconds; })
      .add("miss_m", "from the docked position at the end [m]", [](const RunRow& r) { return r.run.miss; })
      .add("least_miss_m", "the least at any time [m]", [](const RunRow& r) { return r.run.least_miss; })
      .add("effort_s", "integral of the squared commands, each over half its range [s]",
           [](const RunRow& r) { return r.run.effort; })
      .add("keep_out_violation_m", "inside the keep-out distance while searching or approaching, in truth [m]",
           [](const RunRow& r) { return r.run.keep_out_violation; })
      .add("three_sigma_m",
           "of the estimated relative position at the end, the largest of three axes, where there is one [m]",
           [](const RunRow& r) { return r.run.three_sigma; })
      .add("worst_violation", "of a hard constraint by an accepted plan",
           [](const RunRow& r) { return r.run.worst_violation; })
      .add("plans", "how many", [](const RunRow& r) { return r.run.plans; })
      .add("not_accepted", "of them, with a violation above 1e-6", [](const RunRow& r) { return r.run.not_accepted; })
      .add("shifted", "of them, the plan before a step later", [](const RunRow& r) { return r.run.shifted; })
      .add("solve_median_ms", "processor time of a plan that had one before it [ms]",
           [](const RunRow& r) { return r.solve_quantile(0.5); })
      .add("solve_99_ms", "99th percentile, likewise [ms]", [](const RunRow& r) { return r.solve_quantile(0.99); });
}

CsvTable<RendezvousStep> step_columns() {
  return CsvTable<RendezvousStep>()
      .add("t", "s", [](const RendezvousStep& s) { return s.t; })
      .add("phase", "searching, approach, docking or retreat", [](const RendezvousStep& s) { return name(s.phase); })
      .add_xyz("chaser_{}_m", "true position, world axes [m]",
               [](const RendezvousStep& s) { return s.chaser.translation(); })
      .add_xyz("target_{}_m", "likewise", [](const RendezvousStep& s) { return s.target.translation(); })
      .add("distance_m", "of the two [m]", [](const RendezvousStep& s) { return s.distance; })
      .add("miss_m", "from the phase's goal [m]", [](const RendezvousStep& s) { return s.miss; })
      .add_xyz("error_{}_m", "of the estimated relative position, along the chaser's axes [m]",
               [](const RendezvousStep& s) { return Vector<3>(s.estimated.translation() - s.relative.translation()); })
      .add_xyz("three_sigma_{}_m", "of the same; zero while searching",
               [](const RendezvousStep& s) { return s.three_sigma; })
      .add("plan", "how the plan came about, and by which solver", [](const RendezvousStep& s) { return s.origin; })
      .add("violation", "of its hard constraints", [](const RendezvousStep& s) { return s.violation; })
      .add("solve_ms", "that it took by the clock [ms]", [](const RendezvousStep& s) { return 1e3 * s.solve_seconds; })
      .add("processor_ms", "of the processor [ms]", [](const RendezvousStep& s) { return 1e3 * s.processor_seconds; })
      .add("first_plan", "1: none before it in its phase to begin with, else 0",
           [](const RendezvousStep& s) { return int(s.first); });
}

}  // namespace

double quantile_of(std::vector<double> values, double q) {
  if (values.empty()) return std::nan("");
  std::sort(values.begin(), values.end());
  return values[std::min(values.size() - 1, std::size_t(q * double(values.size())))];
}

std::vector<double> solve_seconds(const RendezvousRun& run) {
  std::vector<double> seconds;
  for (const RendezvousStep& step : run.steps)
    if (!step.origin.empty() && !step.first) seconds.push_back(step.processor_seconds);
  return seconds;
}

RendezvousStudy study_rendezvous(const Vehicle& vehicle, const RendezvousOptions& options,
                                 const std::vector<RendezvousMethod>& methods, int seeds,
                                 const std::function<bool(RendezvousMethod, const RendezvousRun&)>& each) {
  RendezvousStudy study{vehicle.name, options, methods, {}};
  for (const RendezvousMethod method : methods) {
    auto& runs = study.runs.emplace_back();
    for (int i = 0; i < seeds; ++i) {
      RendezvousOptions one = options;
      one.method = method;
      one.seed = options.seed + std::uint64_t(i);
      RendezvousRun run = run_rendezvous(vehicle, one);
      if (run.outcome == RendezvousOutcome::interrupted) return study;
      runs.push_back(std::move(run));
      if (!each(method, runs.back())) return study;
    }
  }
  return study;
}

std::string report(const RendezvousStudy& study) {
  using Align = TextTable::Align;
  TextTable table({{study.vehicle, Align::left},
                   {"runs"},
                   {"docked [%]"},
                   {"95 %"},
                   {"time [s]"},
                   {"miss [m]"},
                   {"effort [s]"},
                   {"3 σ [m]"},
                   {"kept out"},
                   {"violation"},
                   {"replan [ms]"},
                   {"99 % [ms]"},
                   {"first, 99 %"}});
  for (std::size_t i = 0; i < study.runs.size(); ++i) {
    const MethodFigures f = figures(study.runs[i]);
    table.row({std::string(name(study.methods[i])), std::to_string(f.runs), shown(100.0 * f.docked / f.runs, 0),
               fmt::format("{:.0f}–{:.0f}", 100 * f.rate.low, 100 * f.rate.high), shown(f.seconds, 1), shown(f.miss, 2),
               shown(f.effort, 1), shown(f.three_sigma, 2),
               f.keep_out_violations ? fmt::format("-{:.2f} m", f.keep_out) : std::string("yes"),
               f.plans ? fmt::format("{:.1e}", f.violation) : "–", shown(f.solve_median, 1), shown(f.solve_99, 1),
               shown(f.first_99, 1)});
  }
  return table.str();
}

std::string rendezvous_json(const RendezvousStudy& study) {
  StudyJson json;
  json["scenario"] = fmt::format("rendezvous of a {}", study.vehicle);
  json["frame"] = Frame().name();
  json["horizon_s"] = study.options.horizon;
  for (std::size_t i = 0; i < study.runs.size(); ++i) {
    const MethodFigures f = figures(study.runs[i]);
    StudyJson& m = json["methods"][std::string(name(study.methods[i]))];
    m["runs"] = f.runs;
    m["docked"] = f.docked;
    m["rate_95"] = {f.rate.low, f.rate.high};
    m["seconds_median"] = json_of(f.seconds);
    m["least_miss_median_m"] = json_of(f.miss);
    m["effort_median_s"] = json_of(f.effort);
    m["three_sigma_end_median_m"] = json_of(f.three_sigma);
    m["keep_out_violations"] = f.keep_out_violations;
    m["worst_keep_out_violation_m"] = f.keep_out;
    m["worst_plan_violation"] = f.violation;
    m["plans"] = f.plans;
    m["plans_not_accepted"] = f.not_accepted;
    m["plans_shifted"] = f.shifted;
    m["solve_median_ms"] = json_of(f.solve_median);
    m["solve_99_ms"] = json_of(f.solve_99);
    m["first_99_ms"] = json_of(f.first_99);
  }
  return json_text(json);
}

void write_rendezvous(const RendezvousStudy& study, const std::filesystem::path& folder) {
  const CsvTable<RunRow> table = run_columns();
  std::string runs = table.header();
  for (std::size_t i = 0; i < study.runs.size(); ++i)
    for (const RendezvousRun& run : study.runs[i]) runs += table.row({study.methods[i], run});
  write_file(folder / "runs.csv", runs);
  if (!study.runs.empty() && !study.runs.front().empty())
    write_file(folder / "rendezvous.csv", step_columns().text(study.runs.front().front().steps));
  write_file(folder / "summary.json", rendezvous_json(study));
}

std::vector<CsvDescription> rendezvous_file_columns() {
  return {run_columns().describe("runs.csv"), step_columns().describe("rendezvous.csv")};
}

}  // namespace tandem
