#include <algorithm>
#include <chrono>
#include <cmath>

#include <tandem/lie/error.hpp>
#include <tandem/problem/stop.hpp>
#include <tandem/solvers/marginals.hpp>
#include <tandem/solvers/online/heading_alignment.hpp>
#include <tandem/studies/navigation/navigate.hpp>

namespace tandem {
namespace {

constexpr int kMostSolves = 4;
constexpr double kWithoutBiases = 4.0;  // s
/// Samples are summed up anew when a bias is further than this from where they were: m/s², rad/s. The second-order
/// terms that are then left out are below 1e-6 m/s and rad over a second.
constexpr double kNearAccelerometer = 1e-2, kNearGyroscope = 1e-3;

class Seconds {
 public:
  double operator()() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count(); }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

/// Keyframes and states by a fixed-lag pass, each as it leaves the window.
std::vector<Stamped<EgoState>> first_guess(const NavigationData& data, const Alignment& start,
                                           const NavigationOptions& options, const Stop& stop) {
  OnlineOptions online;
  online.ego = options.ego;
  // Without an IMU there are no biases to wait for, and a keyframe for every line.
  online.lag.window = data.imu ? options.first_pass : std::min(options.first_pass, kWithoutBiases);
  online.start = start;
  OnlineEstimator estimator(TrackingData(), online_settings(data), online);
  std::vector<Stamped<EgoState>> states;
  estimator.on_leave = [&](const Stamped<EgoState>& state) { states.push_back(state); };
  replay(data, HUGE_VAL, estimator, stop);
  const auto rest = estimator.window();
  states.insert(states.end(), rest.begin(), rest.end());
  return states;
}

bool summed_up_near(const NavigationProblem& problem) {
  for (std::size_t k = 0; k < problem.keyframes.size(); ++k) {
    const Vector<6> off = problem.state(k).bias - problem.keyframes[k].integrated_at;
    if (off.head<3>().norm() > kNearAccelerometer || off.tail<3>().norm() > kNearGyroscope) return false;
  }
  return true;
}

/// A measurement is placed anew when a delay is further from where it was taken to be: s. Motion is at a constant rate from
/// there, which over 0.2 s of a turn that begins makes a delay 7 % too long.
constexpr double kNearDelay = 5e-3;

double delay_found(const NavigationProblem& built, const EgoSensor& sensor) {
  for (const SensorConstant& c : built.constants)
    if (c.name == sensor.name + ".delay") return built.problem.value(std::get<Variable<Rn<1>>>(c.state)).vector()[0];
  return 0;
}
bool placed_near(const NavigationProblem& built, const NavigationData& placed) {
  return std::all_of(placed.sensors.begin(), placed.sensors.end(),
                     [&](const EgoSensor& s) { return std::abs(delay_found(built, s)) <= kNearDelay; });
}
/// As given, and not as placed.
void add_constants(const NavigationProblem& built, const NavigationData& placed, const Marginals* marginals,
                   Navigation& result) {
  result.constants = found_constants(built.problem, built.constants, marginals);
  for (FoundConstant& c : result.constants)
    for (std::size_t i = 0; i < placed.sensors.size(); ++i)
      if (c.name == placed.sensors[i].name + ".delay")
        c.value += placed.sensors[i].delay - result.data.sensors[i].delay;
}

void add_covariance(NavigationProblem& built, const NavigationData& placed, const Stop& stop, Navigation& result) {
  try {
    const Marginals marginals(built.problem, {}, stop);
    add_constants(built, placed, &marginals, result);
    for (const EgoKeyframe& k : built.keyframes) result.covariance.push_back(ego_covariance(marginals, k));
  } catch (const Error& error) {
    result.covariance.clear();
    result.why_no_covariance = error.what();
    result.cut_short = dynamic_cast<const Stopped*>(&error) != nullptr;
  }
}

void take_vibration(const std::vector<NavigationFinding>& findings, NavigationData& data) {
  for (const NavigationFinding& finding : findings)
    if (finding.kind == NavigationFinding::Kind::vibration) {
      data.imu->noise.accelerometer = finding.accelerometer;
      data.imu->noise.gyroscope = finding.gyroscope;
    }
}

}  // namespace

Navigation navigate(const NavigationData& data, const NavigationOptions& options) {
  const Seconds clock;
  const Stop stop(options.solver);
  Navigation result;
  result.data = data;
  result.findings = check(result.data);
  if (options.vibration) take_vibration(result.findings, result.data);
  OnlineOptions online;
  online.ego = options.ego;
  const Alignment start = options.start ? *options.start : align(result.data, options.alignment, online, stop);
  result.start = start;
  result.states = first_guess(result.data, start, options, stop);
  if (result.states.size() < 2) stop.check("navigation: there are no two keyframes yet");
  if (result.states.size() < 2) throw Error("navigation needs data for two keyframes or more");
  result.alignment_seconds = clock();

  NavigationData placed = result.data;  // with delays as found by now; their priors go along, which are weak
  while (true) {
    // What a pass has found is not given up for the next one, which begins at its values: that ends at once.
    const Stop building = result.solves == 0 ? stop.with_grace() : Stop();
    NavigationProblem built = make_navigation_problem(placed, result.states, start, options.ego, building);
    GaussNewtonOptions solver = options.solver;
    stop.limit(solver);
    if (options.built) options.built(built.problem);
    result.summary = solve(built.problem, solver);
    ++result.solves;
    for (std::size_t k = 0; k < built.keyframes.size(); ++k) result.states[k].value = built.state(k);
    const bool done = result.solves == kMostSolves || (summed_up_near(built) && placed_near(built, placed)) ||
                      !result.summary.converged();
    if (!done) {
      for (EgoSensor& sensor : placed.sensors) sensor.delay += delay_found(built, sensor);
      continue;
    }
    result.residual_blocks = built.problem.num_soft_blocks();
    add_constants(built, placed, nullptr, result);
    if (built.dvl_scale) result.dvl_scale = built.problem.value(*built.dvl_scale).vector()[0];
    result.placed = built.measurements;
    for (const PlacedEgoMeasurement& m : built.measurements)
      result.weight.push_back(m.block ? built.problem.weight(*m.block) : 1.0);
    result.left_out = built.left_out;
    result.splits = built.splits;
    if (!options.covariance)
      result.why_no_covariance = "they were not asked for";
    else if (result.summary.converged())
      add_covariance(built, placed, stop, result);
    result.seconds = clock();
    return result;
  }
}

}  // namespace tandem
