/// Online tracking of a target against a textbook Kalman filter: mean errors of the newest relative position at usbl,
/// optical and gated keyframes and of predictions 5 s and 10 s ahead, the heading at usbl keyframes, the average NEES of
/// all these positions (3 degrees of freedom), and the processor's time of updates, of `tandem track`'s default and of
/// what else it could do. Ratios are against the best of the filter's nine settings, each figure by its own.
///   bench_online SCENARIO...     folders with truth and odometry

#include <cmath>
#include <cstdio>
#include <limits>

#include <tandem/lie/error.hpp>
#include <tandem/studies/live/track_report.hpp>
#include <tandem/studies/scenario/builtin_scenarios.hpp>
#include <tandem/studies/study/constant_velocity_filter.hpp>

namespace {

using namespace tandem;

constexpr std::size_t kFigures = 5;

struct Variant {
  const char* name;
  OnlineOptions options;
};

std::vector<Variant> variants() {
  const auto window = [](TrackingOptions tracking) {
    OnlineOptions options;
    options.tracking = std::move(tracking);
    options.lag.max_iterations = 12;   // as the command has it
    options.reset.max_gap = HUGE_VAL;  // as the filter: every keyframe counts
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

/// Mean errors [m] of the target's newest position relative to the chaser at usbl, optical and gated keyframes, then of
/// predictions `ahead` seconds ahead at all of them: the filter sees the target from the dead-reckoned chaser, its fixes as
/// positions as uncertain as docking_a's.
std::vector<double> errors_of(ConstantVelocityFilter filter, const Scenario& scenario,
                              const std::vector<double>& ahead) {
  std::vector<Moments> moments(3 + ahead.size());
  for (const Keyframe& k : make_keyframes(scenario.data, 0)) {
    const SE3 chaser = pose_at(scenario.data.odometry, k.t).value(),
              truth = pose_at(scenario.truth_chaser, k.t).value();
    const bool first = !filter.started();
    if (k.measured_position) {
      const double sigma = k.type == KeyframeType::optical ? 0.13 : 1.72;
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
    add(moments[k.type == KeyframeType::usbl ? 0 : k.type == KeyframeType::optical ? 1 : 2], 0);
    for (std::size_t i = 0; i < ahead.size(); ++i) add(moments[3 + i], ahead[i]);
  }
  std::vector<double> means;
  for (const Moments& m : moments) means.push_back(m.spread() ? m.spread()->mean : NAN);
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
  LiveOptions options;
  options.online = variant.options;
  FolderFeed feed(scenario);
  const Track track = tandem::track(scenario, options, feed, {});
  const TrackSummary s = summarise(track, scenario, options);
  const auto mean = [](const std::optional<MeanStd>& m) { return m ? m->mean : NAN; };
  for (std::size_t i = 0; i < kFigures; ++i) {
    const double error = mean(i < 3 ? s.errors[i].position : s.ahead[i - 3].position);
    to.error[i] += error;
    to.ratio[i] += error / best[i];
    to.worst[i] = std::max(to.worst[i], error / best[i]);
    to.nees[i] += mean(i < 3 ? s.nees[i] : s.ahead[i - 3].nees);
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
  const std::vector<double> ahead = LiveOptions().ahead;
  std::vector<Scenario> scenarios;
  std::vector<std::vector<double>> best;
  for (int i = 1; i < argc; ++i) {
    scenarios.push_back(read_scenario(find_scenario(argv[i], builtin_scenarios())));
    best.push_back(best_of_filters(scenarios.back(), ahead));
    std::printf("%-30s", scenarios.back().name.c_str());
    for (const double error : best.back()) std::printf("  %6.3f", error);
    std::printf("  m: the best of the filters\n");
  }
  if (scenarios.empty()) throw Error("bench_online takes scenario folders");
  std::printf(
      "mean over these: usbl, optical, gated, 5 s, 10 s ahead: m (ratio: mean, largest; NEES), heading [deg], "
      "p50, p99 [ms]\n");
  for (const Variant& variant : variants()) {
    Sums sums;
    for (std::size_t i = 0; i < scenarios.size(); ++i) add(variant, scenarios[i], best[i], sums);
    print(variant.name, sums);
  }
} catch (const std::exception& error) {
  std::fprintf(stderr, "bench_online: %s\n", error.what());
  return 1;
}
