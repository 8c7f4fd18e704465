#pragma once

#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include <tandem/problem/problem.hpp>
#include <tandem/solvers/linear/block_cholesky.hpp>
#include <tandem/solvers/summary.hpp>

namespace tandem {

/// How far back the window reaches, and what one update may do.
struct FixedLagOptions : SolverOptions {
  FixedLagOptions() { max_iterations = 5; }  // an update

  double window = 60.0;   ///< s: variables older than the newest by more than this are marginalized
  int max_keyframes = 0;  ///< and those beyond so many distinct times (1 ms apart at the least); 0: no such limit
  /// An update has converged when a step's predicted decrease, or the decrease that it missed of its prediction, is
  /// below this part of the cost, or of 1 where that is more.
  double cost_tolerance = 1e-6;
  double step_tolerance = 1e-9;    ///< or when no entry of a step is larger [m, rad]
  double initial_damping = 1e-15;  ///< of the diagonal: a warm start wants whole Gauss-Newton steps
  /// Told each time that is about to leave the window, oldest first, after the solve: its variables have their last
  /// values, and their handles are valid for the last time.
  std::function<void(double t)> leaving;
};

/// Fixed-lag smoothing: a problem whose old variables are marginalized as new ones come, so that an update costs the
/// same for ever, in the same memory. What leaves the window stays behind as a Gaussian prior on what remains
/// (Problem::marginalize), so that linear problems keep the estimate and covariance that all data together give, exactly;
/// others do to the extent that the estimate at the window's old end has settled.
///
///   FixedLagOptions options;
///   options.window = 20.0;
///   FixedLag lag(options);
///   const auto x1 = lag.add(t1, guess, "pose 1");            // a variable at a time
///   lag.problem().minimize(residual, noise, {x0, x1});       // as with any problem
///   lag.update();                                            // x1's value is the estimate; what is too old is gone
///
/// Blocks may be added on any variable that is there, also old ones: late measurements are welcome while
/// why_too_late(t) is empty. Variables without a time are added to problem() and stay for ever. Handles of marginalized
/// variables are no longer valid: problem().has(x) tells, gone() lists them, FixedLagOptions::leaving announces them.
/// Soft blocks only. Deterministic.
class FixedLag {
 public:
  /// Throws Error when an option is out of its range.
  explicit FixedLag(FixedLagOptions options = {});

  Problem& problem() { return problem_; }
  const Problem& problem() const { return problem_; }

  /// A new variable at time t [s], in any order of times. Throws Error when why_too_late(t).
  template <LieGroup G>
  Variable<G> add(double t, const G& initial, std::string name = {}) {
    check_time(t);
    const Variable<G> x = problem_.add(initial, std::move(name));
    insert(t, problem_.id(x));
    return x;
  }

  /// Takes a variable out that was given to add() (Problem::remove does not know of its time).
  template <LieGroup G>
  void remove(const Variable<G>& x) {
    const int id = problem_.has(x) ? problem_.id(x) : -1;
    problem_.remove(x);
    std::erase_if(timed_, [&](const Timed& v) { return v.id == id; });
    forget(id);
  }

  /// The same of a variable of problem() that is there already.
  template <LieGroup G>
  void track(double t, const Variable<G>& x) {
    check_time(t);
    insert(t, problem_.id(x));
  }

  /// Solves the window from the variables' values, then marginalizes what is older than it, unless the solve is refused
  /// or failed. The newest variables' times decide, not a clock.
  Summary update();

  /// The earliest and the latest time of a variable in the window [s]; −infinity before anything was added.
  double oldest() const;
  double newest() const;
  /// Whether the window has moved on past t: a sentence, or nothing when variables at t are welcome.
  std::optional<std::string> why_too_late(double t) const;

  struct Gone {
    double t;
    int id;  ///< Problem::id of its handles; given to other variables from the next add on
  };
  /// The variables that the last update marginalized.
  const std::vector<Gone>& gone() const { return gone_; }

  /// Joint covariance of the variables, in the order given, in the tangent space of right perturbations (as Marginals):
  /// by the factor of the last update's last linearisation, so that of the newest ones it takes microseconds; it grows
  /// with how long ago the oldest of them was added. Fixed variables have none; a direction that nothing observes has a
  /// meaningless large one. Throws Error for a variable that is not there any more, for one that was not there at the
  /// last update, and after an update that failed or whose Hessian is singular.
  template <LieGroup... Gs>
  Matrix<(Gs::dof + ...), (Gs::dof + ...)> covariance(const Variable<Gs>&... x) const {
    check_known({(problem_.has(x) ? problem_.id(x) : -1)...});
    return joint({problem_.id(x)...}, {Gs::dof...});
  }

 private:
  struct Timed {
    double t;
    int id;
  };
  static constexpr double kSameTime = 1e-3;  // s; closer times are one keyframe

  void check_time(double t) const;
  void insert(double t, int id);
  void forget(int id);
  void marginalize_old();
  void check_known(const std::vector<int>& ids) const;
  Eigen::MatrixXd joint(const std::vector<int>& ids, const std::vector<int>& sizes) const;
  Summary solve_window();

  FixedLagOptions options_;
  Problem problem_;
  std::vector<Timed> timed_;  // by time
  std::vector<Gone> gone_;
  bool slid_ = false;  // something has been marginalized

  static constexpr int kFixed = -1, kUnknown = -2;
  std::optional<BlockCholesky> factor_;  // of the last update
  std::vector<int> block_of_variable_;   // in it, or kFixed, or kUnknown
};

/// Empty, or a sentence that says why fixed-lag smoothing cannot take the problem.
std::string why_unsupported(const Problem& problem, const FixedLagOptions& options);

}  // namespace tandem
