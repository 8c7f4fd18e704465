/// Long-run test of online tracking. Simulates a circling chaser and target with the noise of docking_a. Odometry comes
/// at 2 Hz without drift in roll and pitch, USBL fixes every 5 s, optical poses for one minute in ten. The data pass
/// through the text feed into the tracker, with a snapshot every 10 s. Prints update times, errors and memory for equal
/// parts of the run.
///   bench_soak [KEYFRAMES]       (default 100,000)

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/problem/quantile.hpp>
#include <tandem/studies/online/track.hpp>
#include <tandem/studies/scenario/builtin_scenarios.hpp>
#include <tandem/studies/support/resources.hpp>
#include <tandem/studies/support/text.hpp>

namespace {

using namespace tandem;

constexpr int kParts = 20;
constexpr double kOdometry = 0.5, kFix = 5, kOptical = 1, kMinute = 60, kTenMinutes = 600;  // intervals [s]
constexpr double kTurn = 0.005;                                                             // turn rate [rad/s]

SE3 on_circle(double angle, double radius, double z) {
  return SE3(SO3::Exp({0, 0, angle + M_PI / 2}), {radius * std::cos(angle), radius * std::sin(angle), z});
}
SE3 chaser_at(double t) { return on_circle(kTurn * t, 200, -3); }
SE3 target_at(double t) { return on_circle(kTurn * t + 0.1 * std::sin(0.002 * t), 220 + 10 * std::sin(0.003 * t), 0); }

/// Source of text lines for StreamFeed; each call appends the data of 0.5 s.
class Simulation {
 public:
  bool operator()(std::string& to) {
    const double before = t_;
    t_ = kOdometry * double(++steps_);
    Vector<6> slip;
    slip << noise(0.01), 0, 0, 0.0006 * normal_(random_);  // gravity bounds roll and pitch errors
    odometry_ = odometry_ * (chaser_at(before).inverse() * chaser_at(t_)) * SE3::Exp(std::sqrt(kOdometry) * slip);
    odometry_ = SE3(SO3::Exp({0, 0, odometry_.rotation().Log().z()}),
                    odometry_.translation());  // removes rounding errors of roll and pitch
    to += "odometry," + pose_text(odometry_);
    const SE3 seen = chaser_at(t_).inverse() * target_at(t_);
    if (std::fmod(t_, kTenMinutes) < kMinute && std::fmod(t_, kOptical) == 0)
      to += "optical," + pose_text(SE3(seen.rotation() * SO3::Exp(noise(0.04)), seen.translation() + noise(0.137)));
    if (std::fmod(t_, kFix) == 0) {
      const Vector<3> z = seen.translation() + noise(1.72);
      to += fmt::format("usbl,{},{},{},{}\n", t_, z.x(), z.y(), z.z());
    }
    return true;
  }

 private:
  Vector<3> noise(double sigma) {
    return {sigma * normal_(random_), sigma * normal_(random_), sigma * normal_(random_)};
  }
  std::string pose_text(const SE3& pose) const {
    const auto q = pose.rotation().quaternion().coeffs();
    const Vector<3> p = pose.translation();
    return fmt::format("{},{},{},{},{},{},{},{}\n", t_, p.x(), p.y(), p.z(), q[0], q[1], q[2], q[3]);
  }

  std::mt19937_64 random_{20261122};
  std::normal_distribution<double> normal_;
  double t_ = 0;
  long steps_ = 0;
  SE3 odometry_ = chaser_at(0);
};

/// Statistics of one part of the run.
class Part {
 public:
  void add(const TrackRecord& r) {
    times_.push_back(1e3 * r.processor_seconds);
    unconverged_ += !r.health.converged;
    if (!r.target) return;
    error_ += (r.relative() - chaser_at(r.t).inverse().act(target_at(r.t).translation())).norm();
    ++known_;
  }
  std::size_t size() const { return times_.size(); }
  void print(double t, std::size_t window, std::size_t snapshot) {
    const auto at = [&](double share) { return detail::quantile(times_, share); };
    std::printf("%9.1f  %8.3f %8.3f %8.3f  %9zu  %7.3f  %6zu  %8.1f  %8.1f\n", t / 3600, at(0.5), at(0.99), at(1),
                unconverged_, error_ / double(known_), window, resident_megabytes().value_or(NAN),
                double(snapshot) / 1e3);
    std::fflush(stdout);
    times_.clear();
    unconverged_ = known_ = 0;
    error_ = 0;
  }

 private:
  std::vector<double> times_;                // ms
  std::size_t unconverged_ = 0, known_ = 0;  // records that did not converge; records with a target
  double error_ = 0;
};

}  // namespace

int main(int argc, char** argv) try {
  const auto keyframes = argc > 1 ? parse_positive_integer(argv[1]) : std::optional(100'000);
  if (!keyframes || *keyframes < kParts)
    throw Error(fmt::format("KEYFRAMES must be a whole number of at least {}", kParts));
  const Scenario settings = read_settings(find_scenario("docking_a", builtin_scenarios()), RowsIn::stream);
  std::atomic<bool> stop = false;
  TrackOptions options;
  options.online.hypotheses = true;
  options.online.tracking.mode = Mode::B;
  options.online.lag.max_iterations = 12;  // default of `tandem track`
  options.stop = &stop;
  std::size_t snapshot = 0, window = 0;  // maxima [bytes, keyframes]
  options.on_snapshot = [&](const TrackSnapshot& s) { snapshot = std::max(snapshot, bytes_of(s).size()); };
  StreamFeed feed(settings, Simulation(), "simulation", stop, [](const std::string& why) { throw Error(why); });

  std::printf(
      "          update, processor time [ms]\n  data [h]    median     99 %%  longest  unconverged  error [m]"
      "  window  resident  snapshot [kB]\n");
  Part part;
  int done = 0;
  const auto each = [&](const TrackRecord& r) {
    part.add(r);
    window = std::max(window, r.keyframes);
    if (part.size() < std::size_t(*keyframes) / kParts) return;
    part.print(r.t, window, snapshot);
    if (++done == kParts) stop = true;
  };
  const Track result = track(settings, options, feed, each);
  std::printf("%zu lines, %zu updates, %zu resets, %zu suspensions, %.0f s\n", result.lines, result.records.size(),
              result.health.resets, result.health.suspensions, result.seconds);
} catch (const std::exception& error) {
  std::fprintf(stderr, "bench_soak: %s\n", error.what());
  return 1;
}
