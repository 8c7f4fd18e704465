#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <tandem/problem/problem.hpp>
#include <tandem/solvers/linear/block_cholesky.hpp>
#include <tandem/solvers/online/covariance_extension.hpp>
#include <tandem/solvers/online/fixed_lag_options.hpp>

namespace tandem {

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
    insert(t, x);
    return x;
  }

  /// Takes a variable out. Problem::remove and Problem::marginalize do as well: what is no longer in the problem is
  /// no longer in the window.
  template <LieGroup G>
  void remove(const Variable<G>& x) {
    problem_.remove(x);
    drop_removed();
  }

  /// The same as add() of a variable of problem() that is there already. Throws Error when it has a time.
  template <LieGroup G>
  void track(double t, const Variable<G>& x) {
    check_time(t);
    if (!problem_.has(x)) throw Error("fixed-lag: a time for a variable that is not in the problem (any more)");
    insert(t, x);
  }

  /// Solves the window from the variables' values, then marginalizes what is older than it: see
  /// FixedLagOptions::patience; nothing when the solve is refused or fails. The newest variables' times decide, not a
  /// clock. Throws what `leaving` throws, and Error when a residual of what is to leave is undefined at the estimate; what
  /// has not left by then stays, and later updates try again.
  Summary update();

  /// Brings covariance() up to what has been added since the last update, at the variables' values as they are: the
  /// covariance of a prediction, before what is measured of it is added. A direction that nothing observes has a
  /// large one. False, and then there is no covariance, where a residual is undefined.
  bool relinearize();
  /// Brings covariance() up to the variables that have been added since the last update, relinearize() or extend(), next to
  /// nothing done: by the blocks that read one of them, whose say of other variables counts beside an added one alone. Of
  /// what else has been said meanwhile it knows nothing: values are as they were before that. False where there is no
  /// covariance, these blocks do not determine each variable or do so by a direction that nothing observes, and where known
  /// variables have been fixed, freed or taken out; then they stay unknown. It does not notice blocks that are not there any
  /// more: relinearize().
  bool extend();
  /// Whether there is a covariance, of the last update or relinearize().
  bool has_covariance() const { return !known_.empty(); }

  /// The earliest and the latest time of a variable in the window [s]; −infinity before anything was added.
  double oldest() const;
  double newest() const;
  /// Whether the window has moved on past t: a sentence, or nothing when variables at t are welcome.
  std::optional<std::string> why_too_late(double t) const;

  struct Gone {
    double t;
    int id;  ///< Problem::id of its handles; given to other variables from the next add on
  };
  /// The variables that the last update marginalized, also one that threw.
  const std::vector<Gone>& gone() const { return gone_; }

  /// Joint covariance of the variables, in the order given, in the tangent space of right perturbations (as Marginals):
  /// by the factor of the last update's last linearisation, so that of the newest ones it takes microseconds; it grows
  /// with how far from these the order of elimination has the others. Fixed variables have none; a direction that nothing
  /// observes has a meaningless large one. Throws Error for a variable that is not there any more, for one that neither was
  /// there at the last update or relinearize() nor is known by extend(), and after an update that failed or whose Hessian is singular. Any
  /// number of threads may ask at once, as long as none changes the problem or updates meanwhile.
  template <LieGroup... Gs>
  Matrix<(Gs::dof + ...), (Gs::dof + ...)> covariance(const Variable<Gs>&... x) const {
    return covariance(std::vector<int>{(problem_.has(x) ? problem_.id(x) : -1)...}, std::vector<int>{Gs::dof...});
  }
  /// The same of variables by id (Problem::id) and tangent dimensions.
  Eigen::MatrixXd covariance(const std::vector<int>& ids, const std::vector<int>& dofs) const;

 private:
  struct Timed {
    double t;
    int id;
    std::function<bool(const Problem&)> is_there;  // ids are used again
  };
  static constexpr double kSameTime = 1e-3;  // s; closer times are one keyframe

  template <LieGroup G>
  void insert(double t, const Variable<G>& x) {
    insert({t, problem_.id(x), [x](const Problem& problem) { return problem.has(x); }});
  }
  void check_time(double t) const;
  void insert(Timed variable);
  void drop_removed();
  double window_begin(double stretch) const;
  void marginalize_before(double limit);
  void check_known(const std::vector<int>& ids) const;
  int block_of(int id) const;
  Summary solve_window();
  /// A factor to come, of the program's Hessian, and which block of it is each variable's.
  void expect_factor_of(const Program& program);

  FixedLagOptions options_;
  Problem problem_;
  std::vector<Timed> timed_;  // by time
  std::vector<Gone> gone_;
  bool slid_ = false;  // something has been marginalized

  static constexpr int kFixed = -1, kAdded = -2, kUnknown = -3;
  struct Known {
    int block = kUnknown;  // of the factor, or one of the above
    long long creation = -1;
  };
  std::optional<BlockCholesky> factor_;  // of the last update
  std::vector<Known> known_;             // by id; empty where there is no covariance
  detail::CovarianceExtension extension_;
};

/// Empty, or a sentence that says why fixed-lag smoothing cannot take the problem.
std::string why_unsupported(const Problem& problem, const FixedLagOptions& options);

}  // namespace tandem
