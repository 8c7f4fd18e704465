/// Tracking for as long as asked: a chaser and a target that circle for ever, simulated with docking_a's noise (odometry, whose
/// roll and pitch do not drift, at 2 Hz, a USBL fix each 5 s, optical poses for a minute in each ten), as lines of text through
/// the feed into the tracker, a snapshot each 10 s. Prints, by equal parts of the run, how long updates took, errors, memory.
///   bench_soak [KEYFRAMES]       (default 100,000; prints each part once it is done)

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
#include <tandem/studies/live/track.hpp>
#include <tandem/studies/scenario/builtin_scenarios.hpp>
#include <tandem/studies/support/resources.hpp>
#include <tandem/studies/support/text.hpp>

namespace {

using namespace tandem;

constexpr int kParts = 20;
constexpr double kOdometry = 0.5, kFix = 5, kOptical = 1, kMinute = 60, kTenMinutes = 600;  // s
constexpr double kTurn = 0.005;                                                             // rad/s

SE3 on_circle(double angle, double radius, double z) {
  return SE3(SO3::Exp({0, 0, angle + M_PI / 2}), {radius * std::cos(angle), radius * std::sin(angle), z});
}
SE3 chaser_at(double t) { return on_circle(kTurn * t, 200, -3); }
SE3 target_at(double t) { return on_circle(kTurn * t + 0.1 * std::sin(0.002 * t), 220 + 10 * std::sin(0.003 * t), 0); }

/// The lines of half a second at a time.
class Simulation {
 public:
  bool operator()(std::string& to) {
    const double before = t_;
    t_ = kOdometry * double(++steps_);
    Vector<6> slip;
    slip << noise(0.01), 0, 0, 0.0006 * normal_(random_);  // gravity tells a vehicle its roll and pitch
    odometry_ = odometry_ * (chaser_at(before).inverse() * chaser_at(t_)) * SE3::Exp(std::sqrt(kOdometry) * slip);
    odometry_ = SE3(SO3::Exp({0, 0, odometry_.rotation().Log().z()}), odometry_.translation());  // rounding likewise
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

/// What came of one part of the run.
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
    std::sort(times_.begin(), times_.end());
    const auto at = [&](double share) { return times_[std::size_t(share * double(times_.size() - 1))]; };
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
  std::size_t unconverged_ = 0, known_ = 0;  // of records: whose target is known
  double error_ = 0;
};

}  // namespace

int main(int argc, char** argv) try {
  const auto keyframes = argc > 1 ? whole_number(argv[1]) : std::optional(100'000);
  if (!keyframes || *keyframes < kParts) throw Error(fmt::format("KEYFRAMES is a whole number of {} or more", kParts));
  const Scenario settings = read_settings(find_scenario("docking_a", builtin_scenarios()), RowsIn::stream);
  std::atomic<bool> stop = false;
  LiveOptions options;
  options.online.hypotheses = true;
  options.online.tracking.mode = Mode::B;
  options.online.lag.max_iterations = 12;  // as the command has it
  options.stop = &stop;
  std::size_t snapshot = 0, window = 0;  // bytes, keyframes: the largest
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
