/// Online tracking of a target, by the default of `tandem track` and by its alternatives, against a constant-velocity
/// Kalman filter. Prints the mean error and the mean NEES (3 degrees of freedom) of the newest relative position at
/// keyframes with a position, a pose and no measurement. Prints the same for 5 s and 10 s predictions. Also prints the
/// heading error at position keyframes and the processor time of updates. Ratios are relative to the best of nine
/// filter settings, chosen per number.
///   bench_online SCENARIO...     folders with truth and odometry

#include <array>
#include <cmath>
#include <cstdio>
#include <limits>

#include <tandem/lie/error.hpp>
#include <tandem/studies/online/track_report.hpp>
#include <tandem/studies/scenario/builtin_scenarios.hpp>
#include <tandem/studies/study/constant_velocity_filter.hpp>

namespace {

using namespace tandem;

constexpr std::size_t kFigures = 5;
constexpr std::array kTypes = {KeyframeType::position, KeyframeType::pose, KeyframeType::none};

struct Variant {
  const char* name;
  OnlineOptions options;
};

std::vector<Variant> variants() {
  const auto window = [](TrackingOptions tracking) {
    OnlineOptions options;
    options.tracking = std::move(tracking);
    options.lag.max_iterations = 12;   // default of `tandem track`
    options.reset.max_gap = HUGE_VAL;  // no suspension: every keyframe counts, as for the filter
    return options;
  };
  OnlineOptions hypotheses = window({.mode = Mode::B});
  hypotheses.hypotheses = true;
  return {{"motion hypotheses (default)", hypotheses},
          {"constant-twist", window({})},
          {"constant-twist, non-holonomic", window({.non_holonomic = Role::soft})},
          {"constant-twist, mode B", window({.mode = Mode::B})},
          {"constant-velocity", window({.model = MotionModel::constant_velocity})},
          {"damped-twist", window({.model = MotionModel::damped_twist})},
          {"damped-twist, non-holonomic", window({.model = MotionModel::damped_twist, .non_holonomic = Role::soft})},
          {"damped-twist, mode B", window({.model = MotionModel::damped_twist, .mode = Mode::B})},
          {"damped-velocity", window({.model = MotionModel::damped_velocity})}};
}

struct Sums {
  int runs = 0;
  std::vector<double> error = std::vector<double>(kFigures), ratio = error, worst = error, nees = error;
  double heading = 0, p50 = 0, p99 = 0;
};

/// Returns mean errors of a filter [m]: of the newest relative target position at the keyframes of each of kTypes, then
/// of predictions `ahead` seconds ahead at all keyframes. Fixes are relative to the dead-reckoned chaser and have
/// the noise of docking_a.
std::vector<double> errors_of(ConstantVelocityFilter filter, const Scenario& scenario,
                              const std::vector<double>& ahead) {
  std::vector<Moments> moments(kTypes.size() + ahead.size());
  for (const Keyframe& k : make_keyframes(scenario.data, 0)) {
    const SE3 chaser = pose_at(scenario.data.odometry, k.t).value(),
              truth = pose_at(scenario.truth_chaser, k.t).value();
    const bool first = !filter.started();
    if (k.measured_position) {
      const double sigma = k.type == KeyframeType::pose ? 0.13 : 1.72;
      filter.update(k.t, chaser.act(*k.measured_position), sigma * sigma * Matrix<3, 3>::Identity());
    } else if (!first) {
      filter.predict(k.t);
    }
    if (first) continue;
    const auto add = [&](Moments& to, double h) {
      const auto there = pose_at(scenario.truth_target, k.t + h);
      if (!there) return;
      const Vector<3> seen = chaser.inverse().act(filter.position(h));
      to.add((seen - truth.inverse().act(there->translation())).norm());
    };
    for (std::size_t i = 0; i < kTypes.size(); ++i)
      if (k.type == kTypes[i]) add(moments[i], 0);
    for (std::size_t i = 0; i < ahead.size(); ++i) add(moments[kTypes.size() + i], ahead[i]);
  }
  std::vector<double> means;
  for (const Moments& m : moments) means.push_back(m.mean_std() ? m.mean_std()->mean : NAN);
  return means;
}

std::vector<double> best_of_filters(const Scenario& scenario, const std::vector<double>& ahead) {
  std::vector<double> best(kFigures, std::numeric_limits<double>::infinity());
  for (const double q : {0.1, 0.2, 0.3})
    for (const double tau : {HUGE_VAL, 60.0, 30.0}) {
      const auto errors = errors_of({q, tau}, scenario, ahead);
      for (std::size_t i = 0; i < best.size(); ++i) best[i] = std::min(best[i], errors[i]);
    }
  return best;
}

void add(const Variant& variant, const Scenario& scenario, const std::vector<double>& best, Sums& to) {
  TrackOptions options;
  options.online = variant.options;
  FolderFeed feed(scenario);
  const Track track = tandem::track(scenario, options, feed, {});
  const TrackSummary s = summarise(track, scenario, options);
  const auto mean = [](const std::optional<MeanStd>& m) { return m ? m->mean : NAN; };
  for (std::size_t i = 0; i < kFigures; ++i) {
    const double error = mean(i < 3 ? s.errors[std::size_t(kTypes[i])].position : s.ahead[i - 3].position);
    to.error[i] += error;
    to.ratio[i] += error / best[i];
    to.worst[i] = std::max(to.worst[i], error / best[i]);
    to.nees[i] += mean(i < 3 ? s.nees[std::size_t(kTypes[i])] : s.ahead[i - 3].nees);
  }
  to.heading += mean(s.errors[0].orientation);
  to.p50 += s.processor.median;
  to.p99 += s.processor.p99;
  ++to.runs;
}

void print(const char* name, const Sums& s) {
  std::printf("%-30s", name);
  for (std::size_t i = 0; i < kFigures; ++i)
    std::printf("  %6.3f (%.2f, %.2f; %4.1f)", s.error[i] / s.runs, s.ratio[i] / s.runs, s.worst[i],
                s.nees[i] / s.runs);
  std::printf("  %5.1f  %.2f, %.2f\n", s.heading / s.runs, s.p50 / s.runs, s.p99 / s.runs);
}

}  // namespace

int main(int argc, char** argv) try {
  const std::vector<double> ahead = TrackOptions().ahead;
  std::vector<Scenario> scenarios;
  std::vector<std::vector<double>> best;
  for (int i = 1; i < argc; ++i) {
    scenarios.push_back(read_scenario(find_scenario(argv[i], builtin_scenarios())));
    best.push_back(best_of_filters(scenarios.back(), ahead));
    std::printf("%-30s", scenarios.back().name.c_str());
    for (const double error : best.back()) std::printf("  %6.3f", error);
    std::printf("  m: best filter settings\n");
  }
  if (scenarios.empty()) throw Error("usage: bench_online SCENARIO...");
  std::printf(
      "mean over scenarios: keyframes with a position, a pose, no measurement, 5 s ahead, 10 s ahead [m] (ratio: mean, "
      "largest; NEES), heading [deg], p50, p99 [ms]\n");
  for (const Variant& variant : variants()) {
    Sums sums;
    for (std::size_t i = 0; i < scenarios.size(); ++i) add(variant, scenarios[i], best[i], sums);
    print(variant.name, sums);
  }
} catch (const std::exception& error) {
  std::fprintf(stderr, "bench_online: %s\n", error.what());
  return 1;
}
