#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include <tandem/problem/problem.hpp>
#include <tandem/solvers/fixed_lag/constrained_inverse.hpp>
#include <tandem/solvers/fixed_lag/covariance_extension.hpp>
#include <tandem/solvers/fixed_lag/fixed_lag_options.hpp>
#include <tandem/solvers/linear/block_cholesky.hpp>

namespace tandem {

/// Fixed-lag smoother: a problem whose old variables are marginalized when new ones are added.
///
/// Time and memory of an update are bounded. Variables that leave the window are replaced by a Gaussian prior on the
/// remaining ones (Problem::marginalize). For linear problems, the estimate and covariance are thus exactly those of
/// all data. For nonlinear problems they are approximate; the error is small if new data no longer change the oldest
/// estimates in the window.
///
///   FixedLagOptions options;
///   options.window = 20.0;
///   FixedLag lag(options);
///   const auto x1 = lag.add(t1, guess, "pose 1");  // a variable at a time
///   lag.problem().minimize(residual, noise, {x0, x1});
///   lag.update();  // sets x1 to its estimate; marginalizes old variables
///
/// Blocks may be added to any variable in the window, also to old ones. Late measurements are possible while
/// why_too_late(t) is empty. Variables without a time are added to problem() and never leave. Handles of marginalized
/// variables are invalid; see Problem::has, marginalized() and FixedLagOptions::before_marginalize. Results are
/// deterministic. Thread safety is that of its Problem.
///
/// Hard blocks (Problem::subject_to) are equalities and inequalities on any variables in the window. An update then
/// solves with the active set of the last one (detail::ActiveSetSolve), and with the augmented Lagrangian if that does
/// not converge. Its status is infeasible if no estimate in the window satisfies the constraints. Rows that are active
/// when a variable leaves count as equalities from then on; the others are removed without effect (see
/// Problem::marginalize). Thus linear-quadratic problems with equalities are solved exactly. With inequalities they
/// are, while the active set at the old end of the window is that of all data. Covariances are those of the constrained
/// problem: active rows have no variance.
class FixedLag {
 public:
  /// Throws BadInputError if an option is out of range.
  explicit FixedLag(FixedLagOptions options = {});

  Problem& problem() { return problem_; }
  const Problem& problem() const { return problem_; }

  /// Adds a variable at time t [s]. Times need not be in order. Throws BadInputError if t is not finite or before the
  /// window.
  template <LieGroup G>
  Variable<G> add(double t, const G& initial, std::string name = {}) {
    check_time(t);
    const Variable<G> x = problem_.add(initial, std::move(name));
    insert(t, x);
    return x;
  }

  /// Removes a variable. Problem::remove and Problem::marginalize have the same effect.
  template <LieGroup G>
  void remove(const Variable<G>& x) {
    problem_.remove(x);
    drop_removed();
  }

  /// Assigns a time to a variable of problem(). Throws BadInputError if it already has one or t is before the
  /// window, StaleHandleError if it is not in the problem.
  template <LieGroup G>
  void track(double t, const Variable<G>& x) {
    check_time(t);
    problem_.id(x);  // throws if the handle is invalid
    insert(t, x);
  }

  /// Solves the window from the present values, then marginalizes older variables (see FixedLagOptions::patience).
  ///
  /// The window ends at the newest variable. Nothing is marginalized if the solve fails, if the hard constraints are
  /// infeasible, or if the problem is not supported. Throws the exceptions of `before_marginalize`, and
  /// UndefinedResidualError if a residual of a leaving variable is undefined at the estimate. Variables that have not
  /// left by then remain, and later updates try again.
  Summary update();

  /// Updates covariance() to the present values and blocks without a solve, for instance for the covariance of a
  /// prediction. An unobservable direction gets a large variance. Returns false, and discards the covariance, if a
  /// residual is undefined.
  bool relinearize();
  /// Extends covariance() to the variables added since the last update, relinearize() or extend(). This takes much less
  /// time than relinearize().
  ///
  /// It uses only the blocks that read a new variable; other new blocks and new values are ignored. Returns false, and
  /// leaves the variables without covariance, if there is no covariance to extend, if these blocks do not determine
  /// each new variable, or if an unobservable direction dominates. Also returns false if a known variable has been
  /// fixed, freed or removed. Removed blocks are not noticed; use relinearize() then.
  bool extend();
  /// Returns whether a covariance of the last update or relinearize() is available.
  bool has_covariance() const { return !solved_.known.empty(); }

  /// Earliest and latest time of the variables in the window [s]; −infinity if there are none.
  double oldest() const;
  double newest() const;
  /// Returns the reason if variables at time t are too late for the window, or t is not finite; otherwise nothing.
  std::optional<std::string> why_too_late(double t) const;

  /// A variable that has left the window.
  struct Marginalized {
    double t;
    int id;  ///< former Problem::id, which the next added variable may get
  };
  /// Variables that the last update has marginalized, also if it threw.
  const std::vector<Marginalized>& marginalized() const { return marginalized_; }

  /// Returns the joint covariance of variables, in this order, for right perturbations (as Marginals), at the present
  /// values.
  ///
  /// The first call after an update linearises the window again, because the last step of the update has moved the
  /// values. If variables or blocks have been added or removed before, it returns linearized_covariance() instead. The
  /// newest variables then take microseconds; older ones take longer. Fixed variables have zero covariance. An
  /// unobservable direction has a large variance without meaning.
  ///
  /// Throws StaleHandleError if a handle is invalid, and NumericalError if no update, relinearize() or extend() has
  /// covered a variable, if the last update failed, or if its Hessian is singular.
  template <LieGroup... Gs>
  Matrix<(Gs::dof + ...), (Gs::dof + ...)> covariance(const Variable<Gs>&... x) const {
    return covariance(std::vector<int>{problem_.id(x)...}, std::vector<int>{Gs::dof...});
  }
  /// Returns the same for variables by id (Problem::id) and tangent dimension.
  Eigen::MatrixXd covariance(const std::vector<int>& ids, const std::vector<int>& dofs) const;
  /// Returns the same at the last linearisation of the last update, which precedes its last step. Never linearises. It
  /// is accurate enough for a gate, but not consistent with the values.
  Eigen::MatrixXd linearized_covariance(const std::vector<int>& ids, const std::vector<int>& dofs) const;

 private:
  struct Timed {
    double t;
    int id;
    std::function<bool(const Problem&)> exists;  // needed because ids are reused
  };
  static constexpr double kSameTime = 1e-3;  // [s]; closer times belong to one keyframe

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
  Summary solve_window();
  Summary solve_constrained_window(NlpEvaluator& nlp);

  static constexpr int kFixed = -1, kAdded = -2, kUnknown = -3;
  struct Known {
    int block = kUnknown;  // block of the factor, or one of the constants above
    long long creation = -1;
  };
  /// A factor of the Hessian of the window.
  struct Factored {
    std::optional<BlockCholesky> factor;
    detail::ActiveRows rows;                         // active hard rows; the factor is that of M
    std::vector<Known> known;                        // by id; empty without a covariance
    mutable detail::ConstrainedInverse constrained;  // with active rows

    void prepare(const Problem& problem, const NlpEvaluator& nlp);
    /// Returns the block of the variable that has this id now, or kFixed, kAdded or kUnknown.
    int block_of(const Problem& problem, int id) const;
    /// Linearises the problem at its values. Adds information to each unknown, relative to its own: `damping`, or
    /// detail::kMinInformation if that is not enough, or with active rows detail::kCovarianceDamping. Returns false if
    /// a residual is undefined or nothing is enough.
    bool linearize(Problem& problem, double damping, int threads);
    /// Evaluates the derivatives, and returns whether all are finite.
    bool evaluate(NlpEvaluator& nlp, Eigen::VectorXd& hessian, Eigen::VectorXd& diagonal, Eigen::VectorXd& jacobian);
    Eigen::MatrixXd covariance(const std::vector<int>& ids, const std::vector<int>& dofs) const;
  };
  int block_of(int id) const { return solved_.block_of(problem_, id); }
  bool is_added(int id) const { return block_of(id) == kAdded; }
  int size() const { return problem_.num_variables() + problem_.num_soft_blocks() + problem_.num_hard_blocks(); }
  bool linearize_at_values(const std::vector<int>& ids) const;
  Eigen::MatrixXd covariance(const Factored& from, const std::vector<int>& ids, const std::vector<int>& dofs) const;

  FixedLagOptions options_;
  mutable Problem problem_;   // a linearisation does not change it visibly
  std::vector<Timed> timed_;  // in order of time
  std::vector<Marginalized> marginalized_;
  bool has_marginalized_ = false;

  Factored solved_;  // at the last linearisation of the last update
  detail::CovarianceExtension extension_;
  // At the values that the last update has reached; computed on request.
  mutable Factored at_values_;
  enum class AtValues { same, wanted, known, unavailable };  // same: solved_ is at the values
  mutable AtValues state_ = AtValues::same;
  int size_after_update_ = 0;
  std::unique_ptr<std::mutex> mutex_ = std::make_unique<std::mutex>();  // of at_values_, state_ and inverses
};

/// Returns an empty string, or the reason why fixed-lag smoothing does not support the problem.
std::string why_unsupported(const Problem& problem, const FixedLagOptions& options);

}  // namespace tandem
