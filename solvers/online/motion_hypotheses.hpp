#pragma once

#include <array>
#include <deque>
#include <optional>
#include <vector>

#include <tandem/lie/types.hpp>
#include <tandem/residuals/loss.hpp>

namespace tandem {

/// What a measurement says of a target, in a frame that does not turn, z up but for the tilt that odometry gathers.
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

/// How a target may move; densities are root spectral densities. All finite.
struct HypothesesNoise {
  double drift;       ///< m s^-3/2: of a drifting point's acceleration, along x and y
  double drift_time;  ///< s: in which its velocity is forgotten
  double surge;       ///< m s^-3/2: of the speed along a course
  double yaw_rate;    ///< rad s^-3/2
  double yaw_time;    ///< s: in which a turn is forgotten
  double climb;       ///< m/√s: how the height walks, of both
  double tilt;        ///< rad/√s: how the frame that fixes are in tilts, about either horizontal axis
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
/// point is clearly under way.
///
/// Nobody knows the noise: a target may be calmer than said or many times as lively, fixes twice as good. Both hypotheses
/// are there for several such guesses, which count by how likely they made all the fixes so far; in a long silence all
/// count again.
///
/// A target keeps its height above a level plane, from which the frame, dead reckoned, tilts away: how the plane slopes is
/// a state, too. That the way to the target tilts as well is left to `climb`, which covers it for some 80 m by an
/// odometry of 0.0006 rad/√s. Only the newest is seen; what measurements say of the past is the smoother's to tell. Fixes may come in
/// any order within what is kept. Deterministic.
/// Source: Bar-Shalom, Li & Kirubarajan 2001, Estimation with Applications to Tracking and Navigation, ch. 11: static
/// multiple models, here of likelihoods that fade between hypotheses but not between guesses, and nearly constant turns.
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
  /// At t, finite and no earlier than the newest instant. started() is required.
  TargetMoments at(double t) const;

  /// All that was learned until an instant [s], the oldest that is kept.
  struct Memory {
    double t;
    std::vector<double> numbers;  ///< go_on_from() reads them
  };
  /// started() is required.
  Memory memory() const;
  /// What was before that instant is as another one had it, but for rounding, whose fixes from there on this one was given.
  /// Throws Error where it is no memory of this version.
  void go_on_from(const Memory& memory);

 private:
  static constexpr int kDim = 8;

  /// Times the noise that is given: of the motion, and the deviations of fixes. Why these: docs/results.md.
  struct NoiseGuess {
    double motion, fixes;
  };
  static constexpr std::array<NoiseGuess, 8> kGuesses{
      {{1.0 / 3, 1}, {1, 1}, {3, 1}, {9, 1}, {1.0 / 3, 0.5}, {1, 0.5}, {3, 0.5}, {9, 0.5}}};

  /// Drift: position, velocity in x and y, and nothing. Course: position, heading, speed, yaw rate. Then, of both, the
  /// height gained for each metre along x and along y.
  struct Filter {
    Vector<kDim> x;
    Matrix<kDim, kDim> P;
    double log_weight = 0;  // against the other of the two
  };
  /// The two hypotheses by one guess of the noise.
  struct Pair {
    NoiseGuess guess;
    Filter drift;
    std::optional<Filter> course;
    double log_evidence = 0;  // against the other guesses

    double log_weight() const;  // of both together
  };
  using State = std::array<Pair, kGuesses.size()>;
  struct Instant {
    double t;
    std::vector<TargetFix> fixes;
    State after;      ///< all of them
    double seen = t;  ///< s, the last fix until then
  };

  static Pair begin(const TargetFix& fix, const NoiseGuess& guess);
  static State start(const TargetFix& fix);
  void move(Pair& pair, double dt) const;
  void move_drift(Filter& f, double motion, double dt) const;
  void move_course(Filter& f, double motion, double dt) const;
  void take(State& state, const TargetFix& fix) const;
  void update(Pair& pair, const TargetFix& fix) const;
  void set_out(Pair& pair) const;
  void run(std::size_t from);
  template <class F>
  static void each_number(Instant& instant, F f);

  HypothesesNoise noise_;
  std::deque<Instant> history_;  // by time
  bool forgotten_ = false;       // there was something before
};

}  // namespace tandem
