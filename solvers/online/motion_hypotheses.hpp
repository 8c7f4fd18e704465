#pragma once

#include <array>
#include <cmath>
#include <deque>
#include <optional>
#include <vector>

#include <tandem/lie/types.hpp>
#include <tandem/residuals/loss.hpp>

namespace tandem {

/// A position fix of a target, in the dead-reckoning frame of the chaser: fixed orientation, z up except for the tilt
/// that odometry accumulates.
struct TargetFix {
  Vector<3> position;               ///< m
  Matrix<3, 3> covariance;          ///< m²
  std::optional<double> heading{};  ///< rad, if a pose was measured
  double heading_sigma = 0;         ///< rad
  Loss loss{};                      ///< loss on the innovation
};

/// Mean and covariance of the target's position, and its velocity.
struct TargetMoments {
  Vector<3> position;             ///< m
  Matrix<3, 3> covariance;        ///< m²
  Vector<3> velocity;             ///< m/s
  std::optional<double> heading;  ///< rad; empty until a course is known
};

/// Noise of the target's motion, as root spectral densities. All values must be finite.
struct HypothesesNoise {
  double drift;       ///< Acceleration of the drift hypothesis along x and y [m s^-3/2].
  double drift_time;  ///< Time constant of its velocity [s].
  double surge;       ///< Acceleration along a course [m s^-3/2].
  double yaw_rate;    ///< Angular acceleration [rad s^-3/2].
  double yaw_time;    ///< Time constant of the yaw rate [s].
  double climb;       ///< Random walk of the height, for both hypotheses [m/√s].
  double tilt;        ///< Random walk of the tilt of the frame, about each horizontal axis [rad/√s].
};

/// Limits of the target's motion; infinite for none.
struct HypothesesLimits {
  double min_surge = -HUGE_VAL, max_surge = HUGE_VAL;  ///< m/s
  double max_yaw_rate = HUGE_VAL;                      ///< of the magnitude [rad/s]
  /// Standard deviations of soft limits [m/s, rad/s]; 0 for hard limits.
  double surge_sigma = 0, yaw_rate_sigma = 0;
};

/// Estimates and predicts the newest state of a target with a bank of Kalman filters. There are two motion hypotheses:
///
///   drift    a point whose velocity in the world decays exponentially: agile and linear. After a pose measurement, its
///            velocity has the direction of the heading (no sway).
///   course   a vessel that moves along its heading with a nearly constant speed and yaw rate: an extended Kalman
///            filter of position, heading, speed and yaw rate, which continues a turn.
///
/// Each hypothesis is weighted by the likelihood of the fixes, with exponential forgetting. The estimate is the mean of
/// the mixture. A course hypothesis is created, or replaced after a failure, when the drift hypothesis clearly moves.
///
/// The true noise is unknown: a target may be calmer or much more agile than stated, and fixes twice as accurate. Hence
/// both hypotheses run for several noise scales, which are weighted by the likelihood of all fixes so far, without
/// forgetting. During a long gap without fixes, the weights of the noise scales return to equal.
///
/// The target stays near a horizontal plane. The dead-reckoning frame tilts slowly, so the slope of the plane is a
/// state. `climb` covers the tilt of the line of sight up to a distance of 80 m, for odometry noise of 0.0006 rad/√s.
///
/// A filter whose speed or yaw rate is beyond a limit is conditioned on the limit, after each step and each fix. The
/// drift hypothesis has no heading, so the limits on the surge apply to its speed, and that on the yaw rate does not.
///
/// Fixes may arrive in any order within the stored history. Results are deterministic. Only the newest state is
/// estimated; the smoother estimates the past. Source: Bar-Shalom, Li & Kirubarajan 2001, Estimation with Applications
/// to Tracking and Navigation, ch. 11 (static multiple models, nearly constant turns).
class MotionHypotheses {
 public:
  explicit MotionHypotheses(const HypothesesNoise& noise, const HypothesesLimits& limits = {})
      : noise_(noise), limits_(limits) {}

  /// Adds a fix at time t [s], or only advances to t without a fix. Does nothing without a fix before the first one,
  /// and for times before the stored history.
  void add(double t, const std::optional<TargetFix>& fix);
  /// Drops the history before t, except for its last state. Fixes before t can no longer be added.
  void forget_before(double t);

  bool started() const { return !history_.empty(); }
  double newest() const { return history_.back().t; }
  /// Predicts the target at time t, which must be finite and not before newest(). Requires started().
  TargetMoments at(double t) const;

  /// The state of all filters at the oldest stored time.
  struct Checkpoint {
    double t;                     ///< s
    std::vector<double> numbers;  ///< numbers in the format of restore()
  };
  /// Returns a checkpoint. Requires started().
  Checkpoint checkpoint() const;
  /// Replaces the history up to the time of the checkpoint of another object. If later fixes have been added to both
  /// objects, both agree up to rounding. Throws Error if the checkpoint is not of this version.
  void restore(const Checkpoint& checkpoint);

 private:
  static constexpr int kDim = 8;

  /// Factors on the given noise, of the motion and of the fixes. bench_online measures their effect.
  struct NoiseScale {
    double motion, fixes;
  };
  static constexpr std::array<NoiseScale, 8> kScales{
      {{1.0 / 3, 1}, {1, 1}, {3, 1}, {9, 1}, {1.0 / 3, 0.5}, {1, 0.5}, {3, 0.5}, {9, 0.5}}};

  /// The state is, for drift: position, velocity in x and y, unused; for course: position, heading, speed, yaw rate.
  /// Then, for both: the slope of the plane along x and along y.
  struct Filter {
    Vector<kDim> x = Vector<kDim>::Zero();
    Matrix<kDim, kDim> P = Matrix<kDim, kDim>::Zero();
    double log_weight = 0;  // relative to the other hypothesis
  };
  /// The two hypotheses for one noise scale.
  struct Pair {
    NoiseScale scale;
    Filter drift;
    std::optional<Filter> course;
    double log_evidence = 0;  // relative to the other noise scales

    double log_weight() const;  // log weight of the sum of both
  };
  using State = std::array<Pair, kScales.size()>;
  struct Instant {
    double t;
    std::vector<TargetFix> fixes;
    State after;          ///< after these fixes
    double last_fix = t;  ///< time of the last fix so far [s]
  };

  static Pair begin(const TargetFix& fix, const NoiseScale& scale);
  static State start(const TargetFix& fix);
  void move(Pair& pair, double dt) const;
  void move_drift(Filter& f, double motion, double dt) const;
  void move_course(Filter& f, double motion, double dt) const;
  void apply(State& state, const TargetFix& fix) const;
  void update(Pair& pair, const TargetFix& fix) const;
  void begin_course(Pair& pair) const;
  void apply_limits(Pair& pair) const;
  void run(std::size_t from);
  template <class F>
  static void for_each_number(Instant& instant, F f);

  HypothesesNoise noise_;
  HypothesesLimits limits_;
  std::deque<Instant> history_;  // in time order
  bool truncated_ = false;       // older history was dropped
};

}  // namespace tandem
