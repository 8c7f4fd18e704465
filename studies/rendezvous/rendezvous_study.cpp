#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include <fmt/format.h>

#include <tandem/problem/quantile.hpp>
#include <tandem/studies/rendezvous/rendezvous_study.hpp>
#include <tandem/studies/scenario/frame.hpp>
#include <tandem/studies/support/json_fields.hpp>
#include <tandem/studies/support/output_file.hpp>
#include <tandem/studies/support/statistics.hpp>
#include <tandem/studies/support/text_table.hpp>

namespace tandem {
namespace {

std::vector<double> replan_milliseconds(const RendezvousRun& run) {
  std::vector<double> ms = replan_seconds(run);
  for (double& t : ms) t *= 1e3;
  return ms;
}

/// Statistics of the runs of one method.
struct MethodStatistics {
  int runs = 0, docked = 0, plans = 0, not_accepted = 0, shifted = 0, keep_out_violations = 0;
  double seconds = 0, miss = 0, effort = 0, three_sigma = 0;  ///< medians; `seconds` over the docked runs only
  double keep_out = 0, violation = 0;                         ///< maxima
  double solve_median = 0, solve_99 = 0, first_99 = 0;        ///< ms
  Interval rate{};                                            ///< share of docked runs with its 95 % interval
};

MethodStatistics statistics(const std::vector<RendezvousRun>& runs) {
  MethodStatistics f;
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
    const std::vector<double> of_run = replan_milliseconds(run);
    ms.insert(ms.end(), of_run.begin(), of_run.end());
    for (const RendezvousStep& step : run.steps)
      if (step.first) first.push_back(1e3 * step.processor_seconds);
  }
  f.seconds = detail::quantile(seconds, 0.5);
  f.miss = detail::quantile(miss, 0.5);
  f.effort = detail::quantile(effort, 0.5);
  f.three_sigma = detail::quantile(sigma, 0.5);
  f.solve_median = detail::quantile(ms, 0.5);
  f.solve_99 = detail::quantile(ms, 0.99);
  f.first_99 = detail::quantile(first, 0.99);
  f.rate = share_interval(std::size_t(f.docked), std::size_t(f.runs)).value_or(Interval{0.0, 0.0, 1.0, 0});
  return f;
}

std::string shown(double value, int decimals) {
  return std::isfinite(value) ? fmt::format("{:.{}f}", value, decimals) : "–";
}

using Statistic = MethodStatistics;

/// Returns a getter of a number; a number that is not finite becomes null.
auto number(double Statistic::*member) {
  return [member](const Statistic& s) { return s.*member; };
}
auto count(int Statistic::*member) {
  return [member](const Statistic& s) { return s.*member; };
}

JsonFields<Statistic> method_fields() {
  return JsonFields<Statistic>()
      .add("runs", "number of runs", count(&Statistic::runs))
      .add("docked", "number of runs that docked", count(&Statistic::docked))
      .add("rate_95", "95 % interval of the share of docked runs (Wilson)",
           [](const Statistic& s) {
             return std::vector<double>{s.rate.low, s.rate.high};
           })
      .add("seconds_median", "median time until docked [s]; null if no run docked", number(&Statistic::seconds))
      .add("least_miss_median_m", "median of the minimum distance from the docked position [m]",
           number(&Statistic::miss))
      .add("effort_median_s", "median control effort [s]", number(&Statistic::effort))
      .add("three_sigma_end_median_m", "median 3σ bound of the relative position at the end [m]",
           number(&Statistic::three_sigma))
      .add("keep_out_violations", "number of runs that entered the keep-out distance",
           count(&Statistic::keep_out_violations))
      .add("worst_keep_out_violation_m", "largest intrusion into the keep-out distance [m]",
           number(&Statistic::keep_out))
      .add("worst_plan_violation", "largest violation of a hard constraint by an accepted plan",
           number(&Statistic::violation))
      .add("plans", "number of plans", count(&Statistic::plans))
      .add("plans_not_accepted", "number of plans that were not accepted", count(&Statistic::not_accepted))
      .add("plans_shifted", "number of fallback plans: the previous plan, shifted by a step",
           count(&Statistic::shifted))
      .add("solve_median_ms", "median processor time of replans [ms]", number(&Statistic::solve_median))
      .add("solve_99_ms", "99th percentile of the processor time of replans [ms]", number(&Statistic::solve_99))
      .add("first_99_ms", "99th percentile of the processor time of first plans [ms]", number(&Statistic::first_99));
}

JsonFields<RendezvousStudy> rendezvous_fields() {
  using S = RendezvousStudy;
  return JsonFields<S>()
      .add("scenario", "description of the simulation",
           [](const S& s) { return fmt::format("rendezvous of a {}", s.vehicle); })
      .add("frame", "frame of the files", [](const S&) { return Frame().name(); })
      .add("horizon_s", "planning horizon [s]", [](const S& s) { return s.options.horizon; })
      .add_map("methods", "METHOD", "statistics of the runs of each method", method_fields(), [](const S& s) {
        std::vector<std::pair<std::string, Statistic>> methods;
        for (std::size_t i = 0; i < s.runs.size(); ++i)
          methods.emplace_back(std::string(name(s.methods[i])), statistics(s.runs[i]));
        return methods;
      });
}

struct RunRow {
  RendezvousMethod method;
  const RendezvousRun& run;

  /// Returns a quantile of the processor times of the run's replans [ms]; nullopt if there are none.
  std::optional<double> solve_quantile(double q) const {
    const std::vector<double> times = replan_milliseconds(run);
    return times.empty() ? std::nullopt : std::optional(detail::quantile(times, q));
  }
};

CsvTable<RunRow> run_columns() {
  return CsvTable<RunRow>()
      .add("method", "decoupled, information, coupled or pursuit", [](const RunRow& r) { return name(r.method); })
      .add("seed", "seed of all noise", [](const RunRow& r) { return r.run.seed; })
      .add("outcome", "docked, failed or timed-out", [](const RunRow& r) { return name(r.run.outcome); })
      .add("why", "reason if the run did not dock: collision or time; else empty",
           [](const RunRow& r) { return r.run.why; })
      .add("seconds", "duration of the run [s]", [](const RunRow& r) { return r.run.seconds; })
      .add("miss_m", "distance from the docked position at the end [m]", [](const RunRow& r) { return r.run.miss; })
      .add("least_miss_m", "minimum distance from the docked position at any time [m]",
           [](const RunRow& r) { return r.run.least_miss; })
      .add("effort_s", "control effort: integral of the sum of squared commands, each divided by half its range [s]",
           [](const RunRow& r) { return r.run.effort; })
      .add("keep_out_violation_m",
           "largest true intrusion into the keep-out distance while searching or approaching [m]",
           [](const RunRow& r) { return r.run.keep_out_violation; })
      .add("three_sigma_m",
           "3 σ of the estimated relative position at the end, largest of three axes; empty without an estimate [m]",
           [](const RunRow& r) { return r.run.three_sigma; })
      .add("worst_violation", "largest violation of a hard constraint by an accepted plan",
           [](const RunRow& r) { return r.run.worst_violation; })
      .add("plans", "number of plans", [](const RunRow& r) { return r.run.plans; })
      .add("not_accepted", "number of plans that were not accepted: a violation above 1e-6, or no solution",
           [](const RunRow& r) { return r.run.not_accepted; })
      .add("shifted", "number of fallback plans: the previous plan, shifted by a step",
           [](const RunRow& r) { return r.run.shifted; })
      .add("solve_median_ms", "median processor time of replans; empty without replans [ms]",
           [](const RunRow& r) { return r.solve_quantile(0.5); })
      .add("solve_99_ms", "99th percentile of the processor time of replans; empty without replans [ms]",
           [](const RunRow& r) { return r.solve_quantile(0.99); });
}

CsvTable<RendezvousStep> step_columns() {
  return CsvTable<RendezvousStep>()
      .add("t", "time [s]", [](const RendezvousStep& s) { return s.t; })
      .add("phase", "searching, approach, docking or retreat", [](const RendezvousStep& s) { return name(s.phase); })
      .add_xyz("chaser_{}_m", "true position of the chaser, world axes [m]",
               [](const RendezvousStep& s) { return s.chaser.translation(); })
      .add_xyz("target_{}_m", "true position of the target, world axes [m]",
               [](const RendezvousStep& s) { return s.target.translation(); })
      .add("distance_m", "true distance between chaser and target [m]",
           [](const RendezvousStep& s) { return s.distance; })
      .add("miss_m", "true distance from the goal of the phase [m]", [](const RendezvousStep& s) { return s.miss; })
      .add_xyz("error_{}_m",
               "error of the estimated relative position along the chaser's axes; not valid while searching [m]",
               [](const RendezvousStep& s) { return Vector<3>(s.estimated.translation() - s.relative.translation()); })
      .add_xyz("three_sigma_{}_m",
               "3 σ of the estimated relative position along the chaser's axes; zero while searching [m]",
               [](const RendezvousStep& s) { return s.three_sigma; })
      .add("plan", "origin of the plan (solved, stopped or shifted) and solver; empty without a plan",
           [](const RendezvousStep& s) { return s.origin; })
      .add("violation", "largest violation of the plan's hard constraints",
           [](const RendezvousStep& s) { return s.violation; })
      .add("solve_ms", "wall-clock time of the plan [ms]",
           [](const RendezvousStep& s) { return 1e3 * s.solve_seconds; })
      .add("processor_ms", "processor time of the plan [ms]",
           [](const RendezvousStep& s) { return 1e3 * s.processor_seconds; })
      .add("first_plan", "1 for a plan without a previous plan in its phase, else 0",
           [](const RendezvousStep& s) { return int(s.first); });
}

}  // namespace

std::vector<double> replan_seconds(const RendezvousRun& run) {
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
                   {"95 % CI"},
                   {"time [s]"},
                   {"least miss [m]"},
                   {"effort [s]"},
                   {"3 σ [m]"},
                   {"keep-out"},
                   {"violation"},
                   {"replan [ms]"},
                   {"99 % [ms]"},
                   {"first, 99 % [ms]"}});
  for (std::size_t i = 0; i < study.runs.size(); ++i) {
    const MethodStatistics f = statistics(study.runs[i]);
    table.row({std::string(name(study.methods[i])), std::to_string(f.runs), shown(100.0 * f.docked / f.runs, 0),
               fmt::format("{:.0f}–{:.0f}", 100 * f.rate.low, 100 * f.rate.high), shown(f.seconds, 1), shown(f.miss, 2),
               shown(f.effort, 1), shown(f.three_sigma, 2),
               f.keep_out_violations ? fmt::format("-{:.2f} m", f.keep_out) : std::string("kept"),
               f.plans ? fmt::format("{:.1e}", f.violation) : "–", shown(f.solve_median, 1), shown(f.solve_99, 1),
               shown(f.first_99, 1)});
  }
  return table.str();
}

std::string rendezvous_json(const RendezvousStudy& study) {
  return json_text(json_document("rendezvous", rendezvous_fields(), study));
}

FileDescription rendezvous_json_keys() { return describe_json("summary.json", "rendezvous", rendezvous_fields()); }

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

std::vector<FileDescription> rendezvous_file_columns() {
  return {run_columns().describe("runs.csv"), step_columns().describe("rendezvous.csv")};
}

}  // namespace tandem
