#pragma once

#include <deque>
#include <optional>
#include <vector>

#include <tandem/lie/types.hpp>
#include <tandem/residuals/loss.hpp>

namespace tandem {

/// What a measurement says of a target, in a frame that does not turn, z up.
struct TargetFix {
  Vector<3> position;               ///< m
  Matrix<3, 3> covariance;          ///< m²
  std::optional<double> heading{};  ///< rad, where a pose was measured
  double heading_sigma = 0;         ///< rad
  Loss loss{};                      ///< on the innovation
};

/// The first two moments of where a target is.
struct TargetMoments {
  Vector<3> position;             ///< m
  Matrix<3, 3> covariance;        ///< m²
  Vector<3> velocity;             ///< m/s
  std::optional<double> heading;  ///< rad; none before a course is known
};

/// How a target may move; densities are root spectral densities.
struct HypothesesNoise {
  double drift;       ///< m s^-3/2: of a drifting point's acceleration, along x and y
  double drift_time;  ///< s: in which its velocity is forgotten
  double surge;       ///< m s^-3/2: of the speed along a course
  double yaw_rate;    ///< rad s^-3/2
  double yaw_time;    ///< s: in which a turn is forgotten
  double climb;       ///< m/√s: how the height walks, of both
};

/// Where a target is now and in some seconds, by two hypotheses of how it moves, each a Kalman filter:
///
///   drift    a point whose velocity, along the world's axes, is forgotten in time: agile, and linear; where a pose was
///            measured, it goes where it faces (no sway)
///   course   a vessel that goes where it faces, at a speed that hardly changes, and turns steadily: an extended Kalman
///            filter of position, heading, speed and yaw rate, so that in a turn it goes on turning
///
/// Each counts by how likely it made the fixes, those of long ago less and less; the estimate is the mean of their
/// mixture, so that between them it hedges. A course begins, and after it has failed begins again, where the drifting
/// point is clearly under way. It sees the newest state alone: what measurements say of the past is the smoother's to
/// tell. Fixes may come in any order within what is kept. Deterministic.
/// Source: Bar-Shalom, Li & Kirubarajan 2001, Estimation with Applications to Tracking and Navigation, ch. 11: static
/// multiple models, here of likelihoods that fade, and nearly constant turns.
class MotionHypotheses {
 public:
  explicit MotionHypotheses(const HypothesesNoise& noise) : noise_(noise) {}

  /// A fix of an instant [s], or none: the instant is then passed. Before the first fix there is nothing to pass; one
  /// before what is kept is left out.
  void add(double t, const std::optional<TargetFix>& fix);
  /// Forgets what is before t but for the last of it: later fixes cannot be of that time any more.
  void forget_before(double t);

  bool started() const { return !history_.empty(); }
  double newest() const { return history_.back().t; }
  /// At t, no earlier than the newest instant. started() is required.
  TargetMoments at(double t) const;

 private:
  /// Drift: position, velocity in x and y, and nothing. Course: position, heading, speed, yaw rate.
  struct Filter {
    Vector<6> x;
    Matrix<6, 6> P;
    double log_weight = 0;
  };
  struct State {
    Filter drift;
    std::optional<Filter> course;
  };
  struct Instant {
    double t;
    std::vector<TargetFix> fixes;
    State after;  ///< all of them
  };

  State start(const TargetFix& fix) const;
  void move(State& state, double dt) const;
  void move_drift(Filter& f, double dt) const;
  void move_course(Filter& f, double dt) const;
  void update(State& state, const TargetFix& fix) const;
  void set_out(State& state) const;
  void run(std::size_t from);

  HypothesesNoise noise_;
  std::deque<Instant> history_;  // by time
  bool forgotten_ = false;       // there was something before
};

}  // namespace tandem
