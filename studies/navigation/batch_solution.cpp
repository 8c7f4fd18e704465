#include <algorithm>
#include <cmath>

#include <tandem/solvers/online/heading_alignment.hpp>
#include <tandem/studies/navigation/batch_solution.hpp>

namespace tandem {
namespace {

constexpr int kMaxSolves = 4;
constexpr double kWindowWithoutImu = 4.0;  // s
/// Largest change of a bias [m/s², rad/s] for which the preintegrated samples stay valid. Second-order terms are then
/// below 1e-6 m/s and rad over a second.
constexpr double kMaxAccelerometerChange = 1e-2, kMaxGyroscopeChange = 1e-3;
/// Largest change of a delay [s] for which measurements keep their places among the states. The motion is extrapolated
/// at a constant rate from there; at the begin of a turn, 0.2 s of extrapolation make the estimated delay 7 % too long.
constexpr double kMaxDelayChange = 5e-3;

constexpr double kSuggested = 20;     // standard deviations; see GrossErrors
constexpr double kMaxSpeed = 30;      // m/s
constexpr std::size_t kMinWrong = 3;  // rejected measurements of a sensor that is wrong
constexpr double kImuRows = 6;        // independent rows of the IMU in each interval between keyframes
constexpr double kSurpriseOfRow = 5;  // log of the range of gross errors over the standard deviation

/// Returns whether all biases are near those at which the samples were preintegrated.
bool preintegration_is_valid(const NavigationProblem& problem) {
  for (std::size_t k = 0; k < problem.keyframes.size(); ++k) {
    const Vector<6> off = problem.state(k).bias - problem.keyframes[k].preintegration_bias;
    if (off.head<3>().norm() > kMaxAccelerometerChange || off.tail<3>().norm() > kMaxGyroscopeChange) return false;
  }
  return true;
}

bool places_are_valid(const NavigationProblem& built, const NavigationData& placed) {
  return std::all_of(placed.sensors.begin(), placed.sensors.end(),
                     [&](const EgoSensor& s) { return std::abs(estimated_delay(built, s)) <= kMaxDelayChange; });
}

double largest_speed(const BatchSolution& solution) {
  double largest = 0;
  for (const Stamped<EgoState>& state : solution.states) largest = std::max(largest, state.value.velocity.norm());
  return largest;
}

std::size_t wrong_sensors(const std::vector<std::size_t>& rejected) {
  return std::size_t(std::count_if(rejected.begin(), rejected.end(), [](std::size_t n) { return n >= kMinWrong; }));
}

/// Returns the cost of a solution plus the surprise of the measurements that it rejects anywhere.
double total_cost(const BatchSolution& solution) {
  double rows = 0;
  const std::vector<std::size_t> rejected = solution.errors.rejected_in({{-HUGE_VAL, HUGE_VAL}});
  for (std::size_t s = 0; s < rejected.size(); ++s)
    rows += double(rejected[s]) * double(solution.placed.sensors[s].sigma.size());
  for (const auto& [from, to] : solution.without_imu)
    rows += kImuRows * std::max(0.0, std::min(to, solution.states.back().t) - from) / solution.placed.keyframe_interval;
  return solution.summary.cost + kSurpriseOfRow * rows;
}

}  // namespace

double estimated_delay(const NavigationProblem& built, const EgoSensor& sensor) {
  for (const SensorConstant& c : built.constants)
    if (c.name == sensor.name + ".delay") return built.problem.value(std::get<Variable<Rn<1>>>(c.state)).vector()[0];
  return 0;
}

BatchSolution::BatchSolution(const NavigationData& data, Imu imu, const Alignment& start,
                             const NavigationOptions& options, const Stop& stop)
    : placed(data), errors(data, imu == Imu::trusted ? 0 : kSuggested), start_(start) {
  OnlineOptions online;
  online.ego = options.ego;
  // Without an IMU, there are no biases that need a long window, and every measurement makes a keyframe.
  online.lag.window = data.imu ? options.first_pass : std::min(options.first_pass, kWindowWithoutImu);
  online.start = start;
  if (!options.gated_first_pass) online.reset = ResetOptions::never();
  if (imu == Imu::trusted) online.reset.reset_after = HUGE_VAL;
  OnlineEstimator estimator(TrackingData(), online_settings(data), online);
  // Each state counts as it leaves the window.
  estimator.on_leave = [&](const Stamped<EgoState>& state) { states.push_back(state); };
  estimator.on_reject = [&](const std::string& sensor, const Rejection& why) {
    if (options.reject_gross_errors && why.kind == Rejection::Kind::outside_gate)
      errors.suggest(sensor, why.t, why.sigmas);
  };
  replay(data, HUGE_VAL, estimator, stop);
  if (imu == Imu::excludable) errors.keep_rare();
  const auto rest = estimator.window();
  states.insert(states.end(), rest.begin(), rest.end());
  if (!options.reject_gross_errors) return;
  without_imu = estimator.imu_exclusions();
  for (const auto& [from, to] : without_imu)
    std::erase_if(placed.imu->samples, [from = from, to = to](const ImuSample& x) { return x.t >= from && x.t <= to; });
}

void BatchSolution::solve(const NavigationOptions& options, const Stop& stop, bool trial) {
  for (int round = 1;; ++round) {
    // A further problem is built even if the limit is reached; its solve then ends at once, at the values of the one
    // before.
    const Stop building = solves == 0 ? stop.with_grace() : Stop();
    built.emplace(make_navigation_problem(placed, states, start_, options.ego, building));
    errors.apply(*built);
    GaussNewtonOptions solver = options.solver;
    stop.limit(solver);
    if (options.built) options.built(built->problem);
    summary = tandem::solve(built->problem, solver);
    ++solves;
    for (std::size_t k = 0; k < built->keyframes.size(); ++k) states[k].value = built->state(k);
    const bool done = round == kMaxSolves || (preintegration_is_valid(*built) && places_are_valid(*built, placed)) ||
                      !summary.converged();
    if (!done) {
      for (EgoSensor& sensor : placed.sensors) sensor.delay += estimated_delay(*built, sensor);
      continue;
    }
    if (trial && !summary.converged()) return;
    if (!options.reject_gross_errors || stop.reached() || !errors.revise(*built)) return;
    round = 0;
  }
}

bool explains_better(const BatchSolution& trusting, const BatchSolution& excluding) {
  if (!trusting.summary.converged()) return false;
  const double fast = largest_speed(trusting), slow = largest_speed(excluding);
  if (std::max(fast, slow) > kMaxSpeed && std::max(fast, slow) > 2 * std::min(fast, slow)) return fast < slow;
  const std::size_t wrong = wrong_sensors(trusting.errors.rejected_in(excluding.without_imu));
  if (wrong > 1 + wrong_sensors(excluding.errors.rejected_in(excluding.without_imu))) return false;
  return total_cost(trusting) < total_cost(excluding);
}

}  // namespace tandem
