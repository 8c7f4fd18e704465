#include <algorithm>
#include <chrono>
#include <cmath>

#include <tandem/lie/error.hpp>
#include <tandem/problem/navigation/ego_trajectory.hpp>
#include <tandem/problem/stop.hpp>
#include <tandem/solvers/marginals.hpp>
#include <tandem/solvers/online/heading_alignment.hpp>
#include <tandem/studies/fit/judged_measurements.hpp>
#include <tandem/studies/navigation/averaged_readings.hpp>
#include <tandem/studies/navigation/gross_errors.hpp>
#include <tandem/studies/navigation/navigate.hpp>

namespace tandem {
namespace {

constexpr int kMaxSolves = 4;
constexpr double kWindowWithoutImu = 4.0;  // s
/// Largest change of a bias [m/s², rad/s] for which the preintegrated samples stay valid. Second-order terms are then
/// below 1e-6 m/s and rad over a second.
constexpr double kMaxAccelerometerChange = 1e-2, kMaxGyroscopeChange = 1e-3;

class Seconds {
 public:
  double operator()() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count(); }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

using Intervals = std::vector<std::pair<double, double>>;  // start and end [s]

/// Drops the samples in these intervals, and reports them.
void drop_samples(const Intervals& intervals, NavigationData& data, std::vector<NavigationFinding>& findings) {
  for (const auto& interval : intervals) {
    NavigationFinding finding{NavigationFinding::Kind::rejected, data.imu->name};
    std::erase_if(data.imu->samples, [&](const ImuSample& sample) {
      if (sample.t < interval.first || sample.t > interval.second) return false;
      if (finding.count++ == 0) finding.from = sample.t;
      finding.to = sample.t;
      return true;
    });
    if (finding.count > 0) findings.push_back(finding);
  }
}

/// Returns the states at all keyframes by fixed-lag smoothing, each as it leaves the window. Suggests the measurements
/// outside of its gate as gross errors.
std::vector<Stamped<EgoState>> initial_guess(const NavigationData& data, const Alignment& start,
                                             const NavigationOptions& options, const Stop& stop, GrossErrors& errors,
                                             Intervals& without_imu) {
  OnlineOptions online;
  online.ego = options.ego;
  // Without an IMU, there are no biases that need a long window, and every measurement makes a keyframe.
  online.lag.window = data.imu ? options.first_pass : std::min(options.first_pass, kWindowWithoutImu);
  online.start = start;
  OnlineEstimator estimator(TrackingData(), online_settings(data), online);
  std::vector<Stamped<EgoState>> states;
  estimator.on_leave = [&](const Stamped<EgoState>& state) { states.push_back(state); };
  estimator.on_reject = [&](const std::string& sensor, const Rejection& why) {
    if (options.reject_gross_errors && why.kind == Rejection::Kind::outside_gate)
      errors.suggest(sensor, why.t, why.sigmas);
  };
  replay(data, HUGE_VAL, estimator, stop);
  errors.keep_rare();
  const auto rest = estimator.window();
  states.insert(states.end(), rest.begin(), rest.end());
  without_imu = estimator.imu_exclusions();
  return states;
}

/// Returns whether all biases are near those at which the samples were preintegrated.
bool preintegration_is_valid(const NavigationProblem& problem) {
  for (std::size_t k = 0; k < problem.keyframes.size(); ++k) {
    const Vector<6> off = problem.state(k).bias - problem.keyframes[k].preintegration_bias;
    if (off.head<3>().norm() > kMaxAccelerometerChange || off.tail<3>().norm() > kMaxGyroscopeChange) return false;
  }
  return true;
}

/// Largest change of a delay [s] for which measurements keep their places among the states. The motion is extrapolated
/// at a constant rate from there; at the begin of a turn, 0.2 s of extrapolation make the estimated delay 7 % too long.
constexpr double kMaxDelayChange = 5e-3;

double estimated_delay(const NavigationProblem& built, const EgoSensor& sensor) {
  for (const SensorConstant& c : built.constants)
    if (c.name == sensor.name + ".delay") return built.problem.value(std::get<Variable<Rn<1>>>(c.state)).vector()[0];
  return 0;
}

bool places_are_valid(const NavigationProblem& built, const NavigationData& placed) {
  return std::all_of(placed.sensors.begin(), placed.sensors.end(),
                     [&](const EgoSensor& s) { return std::abs(estimated_delay(built, s)) <= kMaxDelayChange; });
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

}  // namespace

std::vector<NavigationFinding> prepare(NavigationData& data, const NavigationOptions& options) {
  std::vector<NavigationFinding> findings = check(data);
  if (options.vibration) apply_vibration_noise(findings, data);
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
  GrossErrors errors(result.data);
  Intervals without_imu;
  result.states = initial_guess(result.data, start, options, stop, errors, without_imu);
  if (options.reject_gross_errors) drop_samples(without_imu, result.data, result.findings);
  if (result.states.size() < 2) stop.check("navigation stopped before the second keyframe");
  if (result.states.size() < 2) throw Error("navigation needs data for at least two keyframes");
  result.alignment_seconds = clock();

  NavigationData placed = result.data;  // with the delays of the last solve; their weak priors move along
  for (int solves = 1;; ++solves) {
    // A further problem is built even if the limit is reached; its solve then ends at once, at the values of the one
    // before.
    const Stop building = result.solves == 0 ? stop.with_grace() : Stop();
    NavigationProblem built = make_navigation_problem(placed, result.states, start, options.ego, building);
    errors.apply(built);
    GaussNewtonOptions solver = options.solver;
    stop.limit(solver);
    if (options.built) options.built(built.problem);
    result.summary = solve(built.problem, solver);
    ++result.solves;
    for (std::size_t k = 0; k < built.keyframes.size(); ++k) result.states[k].value = built.state(k);
    const bool done = solves == kMaxSolves || (preintegration_is_valid(built) && places_are_valid(built, placed)) ||
                      !result.summary.converged();
    if (!done) {
      for (EgoSensor& sensor : placed.sensors) sensor.delay += estimated_delay(built, sensor);
      continue;
    }
    if (options.reject_gross_errors && !stop.reached() && errors.revise(built)) {
      solves = 0;
      continue;
    }
    const std::vector<std::vector<double>> rejected = errors.remove(built, result.data, result.findings);
    result.residual_blocks = built.problem.num_soft_blocks();
    add_constants(built, placed, nullptr, result);
    if (built.dvl_scale) result.dvl_scale = built.problem.value(*built.dvl_scale).vector()[0];
    result.placed = built.measurements;
    for (const PlacedEgoMeasurement& m : built.measurements)
      result.weight.push_back(m.block ? built.problem.weight(*m.block) : 1.0);
    result.discarded = built.num_discarded;
    result.splits = built.splits;
    JudgedMeasurements judged;
    add_own_sensors(placed, built.measurements, options.north_east, judged);
    for (std::size_t i = 0; i < rejected.size(); ++i) judged.sensors[i].rejected = rejected[i];
    if (!options.covariance)
      result.why_no_covariance = "not requested";
    else if (result.summary.converged())
      add_covariance(built, placed, judged, options, stop, result);
    if (result.fit.sensors.empty()) result.fit = fit_report(built.problem, judged.sensors, judged.blocks);
    if (result.covariance.empty()) add_states_at(options.at, built, placed, options.ego, nullptr, result);
    result.seconds = clock();
    return result;
  }
}

}  // namespace tandem
