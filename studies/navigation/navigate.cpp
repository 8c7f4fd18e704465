#include <algorithm>
#include <chrono>
#include <memory>

#include <tandem/lie/error.hpp>
#include <tandem/problem/navigation/ego_trajectory.hpp>
#include <tandem/problem/navigation/wrong_first_lines.hpp>
#include <tandem/problem/stop.hpp>
#include <tandem/solvers/marginals.hpp>
#include <tandem/solvers/online/heading_alignment.hpp>
#include <tandem/studies/fit/judged_measurements.hpp>
#include <tandem/studies/navigation/averaged_readings.hpp>
#include <tandem/studies/navigation/batch_solution.hpp>
#include <tandem/studies/navigation/navigate.hpp>

namespace tandem {
namespace {

/// Iterations of the solution without the IMU in the comparison. Without an IMU, wrong data take far more.
constexpr int kTrialIterations = 30;

class Seconds {
 public:
  double operator()() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count(); }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

/// Returns the names of the sensors with rejected measurements, separated by commas.
std::string names_of(const std::vector<std::size_t>& rejected, const NavigationData& data) {
  std::string names;
  for (std::size_t s = 0; s < rejected.size(); ++s)
    if (rejected[s] > 0) names += (names.empty() ? "" : ", ") + data.sensors[s].name;
  return names;
}

/// Drops the samples in these intervals, and reports them. `others`: the sensors that they contradict, if known.
void drop_samples(const BatchSolution::Intervals& intervals, const std::string& others, NavigationData& data,
                  std::vector<NavigationFinding>& findings) {
  for (const auto& interval : intervals) {
    NavigationFinding finding{NavigationFinding::Kind::rejected, data.imu->name};
    if (!others.empty()) finding.channel = " of " + others;
    std::erase_if(data.imu->samples, [&](const ImuSample& sample) {
      if (sample.t < interval.first || sample.t > interval.second) return false;
      if (finding.count++ == 0) finding.from = sample.t;
      finding.to = sample.t;
      return true;
    });
    if (finding.count > 0) findings.push_back(finding);
  }
}

/// Drops the first measurements that those after them contradict, and reports them.
void drop_wrong_first_lines(NavigationData& data, std::vector<NavigationFinding>& findings) {
  for (EgoSensor& sensor : data.sensors) {
    const std::size_t n = wrong_first_lines(sensor);
    if (n == 0) continue;
    findings.push_back({NavigationFinding::Kind::rejected, sensor.name, n, sensor.measurements.front().t,
                        sensor.measurements[n - 1].t, " of the sensor, from which a jump separates them"});
    sensor.measurements.erase(sensor.measurements.begin(), sensor.measurements.begin() + std::ptrdiff_t(n));
  }
}

/// Adds the systematic errors, with delays relative to the given ones instead of those in `placed`.
void add_constants(const NavigationProblem& built, const NavigationData& placed, const Marginals* marginals,
                   Navigation& result) {
  result.constants = systematic_error_estimates(built.problem, built.constants, marginals);
  for (SystematicErrorEstimate& c : result.constants)
    for (std::size_t i = 0; i < placed.sensors.size(); ++i)
      if (c.name == placed.sensors[i].name + ".delay")
        c.value += placed.sensors[i].delay - result.data.sensors[i].delay;
}

/// Adds the states at the requested times, with covariances unless `marginals` is null.
void add_states_at(const std::vector<double>& times, const NavigationProblem& built, const NavigationData& data,
                   const EgoOptions& options, const Marginals* marginals, Navigation& result) {
  result.at.clear();
  if (times.empty()) return;
  std::optional<ImuRecord> imu;
  if (data.imu) imu = record_of(*data.imu);
  const PropagateCovariance propagate = propagate_by(marginals);
  const EgoTrajectory trajectory(built.problem, built.keyframes, imu ? &*imu : nullptr, data.earth, options);
  for (const double t : times) {
    StateAt& state = result.at.emplace_back(StateAt{.t = t});
    state.note = why_outside(t, built.keyframes.front().t, built.keyframes.back().t);
    if (state.note.empty()) state.chaser = trajectory.at(t, propagate);
  }
}

void add_covariance(NavigationProblem& built, const NavigationData& placed, const JudgedMeasurements& judged,
                    const NavigationOptions& options, const Stop& stop, Navigation& result) {
  try {
    const Marginals marginals(built.problem, {}, stop);
    add_constants(built, placed, &marginals, result);
    result.fit = fit_report(built.problem, judged.sensors, judged.blocks, &marginals);
    for (const EgoKeyframe& k : built.keyframes) result.covariance.push_back(ego_covariance(marginals, k));
    add_states_at(options.at, built, placed, options.ego, &marginals, result);
  } catch (const Error& error) {
    result.covariance.clear();
    result.why_no_covariance = error.what();
    result.cut_short = dynamic_cast<const Stopped*>(&error) != nullptr;
  }
}

void apply_vibration_noise(const std::vector<NavigationFinding>& findings, NavigationData& data) {
  for (const NavigationFinding& finding : findings)
    if (finding.kind == NavigationFinding::Kind::vibration) {
      data.imu->noise.accelerometer = finding.accelerometer;
      data.imu->noise.gyroscope = finding.gyroscope;
    }
}

/// Returns the solution that trusts the IMU; null if there is none before the limit.
std::unique_ptr<BatchSolution> solve_trusting_imu(const NavigationData& data, const Alignment& start,
                                                  NavigationOptions options, const Stop& stop) try {
  options.built = {};  // only the problem of the result counts
  auto solution = std::make_unique<BatchSolution>(data, BatchSolution::Imu::trusted, start, options, stop);
  if (stop.reached() || solution->states.size() < 2) return {};
  solution->solve(options, stop);
  return solution;
} catch (const Error&) {
  return {};
}

}  // namespace

std::vector<NavigationFinding> prepare(NavigationData& data, const NavigationOptions& options) {
  std::vector<NavigationFinding> findings = check(data);
  if (options.vibration) apply_vibration_noise(findings, data);
  if (options.reject_gross_errors) drop_wrong_first_lines(data, findings);
  for (NavigationFinding& finding : average_readings(data)) findings.push_back(std::move(finding));
  return findings;
}

Navigation navigate(const NavigationData& data, const NavigationOptions& options) {
  const Seconds clock;
  const Stop stop(options.solver);
  Navigation result;
  result.data = data;
  result.findings = prepare(result.data, options);
  OnlineOptions online;
  online.ego = options.ego;
  const Alignment start = options.start ? *options.start : align(result.data, options.alignment, online, stop);
  result.start = start;
  auto solution = std::make_unique<BatchSolution>(result.data, BatchSolution::Imu::excludable, start, options, stop);
  if (solution->states.size() < 2) stop.check("navigation stopped before the second keyframe");
  if (solution->states.size() < 2) throw Error("navigation needs data for at least two keyframes");
  result.alignment_seconds = clock();
  std::string contradicting;  // sensors that an excluded IMU contradicts
  if (solution->without_imu.empty()) {
    solution->solve(options, stop);
  } else {
    std::unique_ptr<BatchSolution> trusting = solve_trusting_imu(result.data, start, options, stop);
    NavigationOptions trial = options;
    if (trusting) trial.solver.max_iterations = std::min(trial.solver.max_iterations, kTrialIterations);
    solution->solve(trial, stop, trusting != nullptr);
    if (trusting) {
      result.solves = trusting->solves;
      contradicting = names_of(trusting->errors.rejected_in(solution->without_imu), result.data);
      if (explains_better(*trusting, *solution)) {
        std::swap(solution, trusting);
        result.solves = trusting->solves;
        if (options.built) options.built(solution->built->problem);
      } else if (!solution->summary.converged()) {
        solution->solve(options, stop);
      }
    }
    drop_samples(solution->without_imu, contradicting, result.data, result.findings);
  }
  NavigationProblem& built = *solution->built;
  const std::size_t findings = result.findings.size();
  const std::vector<std::vector<double>> rejected = solution->errors.remove(built, result.data, result.findings);
  if (!contradicting.empty() && solution->without_imu.empty())
    for (std::size_t i = findings; i < result.findings.size(); ++i)
      result.findings[i].channel += ", among them " + result.data.imu->name;
  result.solves += solution->solves;
  result.states = std::move(solution->states);
  result.summary = solution->summary;
  result.residual_blocks = built.problem.num_soft_blocks();
  add_constants(built, solution->placed, nullptr, result);
  if (built.dvl_scale) result.dvl_scale = built.problem.value(*built.dvl_scale).vector()[0];
  result.placed = built.measurements;
  for (const PlacedEgoMeasurement& m : built.measurements)
    result.weight.push_back(m.block ? built.problem.weight(*m.block) : 1.0);
  result.discarded = built.num_discarded;
  result.splits = built.splits;
  JudgedMeasurements judged;
  add_own_sensors(solution->placed, built.measurements, options.north_east, judged);
  for (std::size_t i = 0; i < rejected.size(); ++i) judged.sensors[i].rejected = rejected[i];
  if (!options.covariance)
    result.why_no_covariance = "not requested";
  else if (result.summary.converged())
    add_covariance(built, solution->placed, judged, options, stop, result);
  if (result.fit.sensors.empty()) result.fit = fit_report(built.problem, judged.sensors, judged.blocks);
  if (result.covariance.empty()) add_states_at(options.at, built, solution->placed, options.ego, nullptr, result);
  result.seconds = clock();
  return result;
}

}  // namespace tandem
