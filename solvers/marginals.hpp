#pragma once

#include <span>
#include <utility>
#include <vector>

#include <tandem/problem/problem.hpp>
#include <tandem/problem/stop.hpp>
#include <tandem/solvers/linear/selected_inverse.hpp>
#include <tandem/solvers/summary.hpp>

namespace tandem {
namespace detail {
enum class Gauges;
}

/// Marginal covariances of the variables of a problem.
///
/// They are blocks of S = H⁻¹, where H is the Gauss-Newton Hessian at the values of the variables, with robust losses
/// weighted by ρ′. Tangent vectors are right perturbations, X ⊕ δ = X Exp(δ), translation first; units are m², m rad
/// and rad². Solve the problem first: away from the optimum the covariances mean little.
///
/// - Fixed variables have zero covariance.
/// - Hard equalities (equal bounds) restrict the problem, linearised: S = H⁻¹ − H⁻¹Aᵀ (A H⁻¹ Aᵀ)⁻¹ A H⁻¹. Constrained
///   directions have zero variance. H alone may be singular.
/// - Redundant equalities are allowed. Combinations of rows (scaled to norm 1) below 1e-10 count as redundant. Two rows
///   that differ by δ lose digits as 1e-16/δ. A row in which one variable has ε times the weight of another loses
///   digits as 1e-16/ε², if the first variable is eliminated first.
/// - Inequalities are ignored, active or not. The result is conservative.
/// - Tangent entries that take part in an unobservable direction have an infinite variance and zero covariances. This
///   is the limit for a prior whose standard deviation goes to infinity. unobservable() names the entries. The cost,
///   not H alone, defines the unobservable directions. H of a residual that is not zero can have curvature along a
///   direction in which the cost is constant, such as a turn of all residuals (solvers/gauge_search.hpp).
///
/// Stored are the blocks of S on the pattern of the Cholesky factor of H, found by selected inversion
/// (detail::SelectedInverse). They include the block of each variable and of each pair that a residual reads. Each
/// other pair costs one sparse solve per column and call, in time linear in the size of the problem. If many such pairs
/// are needed, pass them to the constructor.
///
/// The object is a snapshot: later changes of the problem have no effect. It has the covariances of variables that are
/// removed later. The functions throw StaleHandleError for a variable that was not in the problem. They may be called
/// from several threads at once.
class Marginals {
 public:
  /// Two variables by id (Problem::id).
  using Pair = std::pair<int, int>;
  /// Computes the covariances, and stores those of all `pairs` too. The time is linear for pairs of neighbours in a
  /// chain. Throws UndefinedResidualError if a residual is undefined or not finite, and NotObservableError if more than
  /// 60 directions are unobservable or nearly so. Throws BadInputError if no variable is free, and Stopped if `stop`
  /// requests it.
  explicit Marginals(Problem& problem, std::span<const Pair> pairs = {}, const Stop& stop = {});
  /// Does the same without the search for gauges, which is faster. propagated(), times(), log_determinant() and
  /// require_regular() do not depend on gauges; other methods then ignore them.
  static Marginals without_gauges(Problem& problem, const Stop& stop = {});

  template <LieGroup A>
  Matrix<A::dof, A::dof> covariance(const Variable<A>& a) const {
    return cross_covariance(a, a);
  }
  /// Returns the cross-covariance with rows of a and columns of b.
  template <LieGroup A, LieGroup B>
  Matrix<A::dof, B::dof> cross_covariance(const Variable<A>& a, const Variable<B>& b) const {
    Matrix<A::dof, B::dof> S;
    block(id(a), id(b), S);
    return S;
  }
  /// Returns the joint covariance of [δa; δb].
  template <LieGroup A, LieGroup B>
  Matrix<A::dof + B::dof, A::dof + B::dof> joint(const Variable<A>& a, const Variable<B>& b) const {
    Matrix<A::dof + B::dof, A::dof + B::dof> S;
    const Matrix<A::dof, B::dof> ab = cross_covariance(a, b);
    S << covariance(a), ab, ab.transpose(), covariance(b);
    return S;
  }
  /// Returns the joint covariance of variables by id, in this order. A pair that is not stored costs one sparse solve
  /// per column.
  Eigen::MatrixXd joint(std::span<const int> variable_ids, std::span<const int> dofs) const;
  /// Returns J S Jᵀ for a linear function J of the tangent vectors of variables, such as the residual of a measurement.
  /// A row has an infinite variance and zero covariances if a null direction of H changes it. A row that no null
  /// direction changes is determined even if it reads entries of infinite variance.
  Eigen::MatrixXd propagated(const Eigen::Ref<const Eigen::MatrixXd>& J, std::span<const int> variable_ids,
                             std::span<const int> dofs) const;
  /// Returns log det H. With hard equalities, H is restricted to their null space, and a constant that depends only on
  /// the equalities is neglected. −infinity if H is singular.
  double log_determinant() const { return parts_.log_determinant; }
  /// Returns S x for a vector x over the unknowns of an NlpEvaluator of the problem. Requires a regular H.
  Eigen::VectorXd times(const Eigen::VectorXd& x) const;
  /// Throws NotObservableError, which names the unobservable states, if H is singular.
  void require_regular() const;
  /// Returns the states with infinite variances; empty if all states are observable.
  const std::vector<UnobservableState>& unobservable() const { return parts_.unobservable; }
  /// Returns whether the covariance of the pair is stored.
  template <LieGroup A, LieGroup B>
  bool in_pattern(const Variable<A>& a, const Variable<B>& b) const {
    return in_pattern(id(a), id(b));
  }

 private:
  struct Parts;
  explicit Marginals(Parts parts) : parts_(std::move(parts)) {}
  int id(const VariableHandle& x) const;
  static void regularize(NlpEvaluator& nlp, const Eigen::VectorXd& hessian, const Stop& stop, detail::Gauges gauges,
                         Parts& parts);
  int block_of(int variable_id) const;
  void block(int a, int b, Eigen::Ref<Eigen::MatrixXd> S) const;
  /// Sets S to a block of the covariance without the unobservable directions, and returns whether it is free.
  bool finite_block(int a, int b, Eigen::Ref<Eigen::MatrixXd> S) const;
  bool in_pattern(int a, int b) const;

  struct Parts {
    std::vector<int> block_of_variable;     // −1 for fixed variables
    std::vector<VariableHandle> variables;  // variables by ID; unused IDs have invalid handles
    std::vector<int> first_unknown;         // first unknown of each block
    detail::SelectedInverse inverse;        // inverse of H, with pinned unknowns if H is nearly singular
    double log_determinant = 0;
    // S is the inverse plus F Fᵀ: flat directions that the residuals observe, although rounding hides them in H.
    Eigen::MatrixXd flat{};
    Eigen::MatrixXd null{};        // null directions of H, one per column
    std::vector<char> infinite{};  // per unknown: infinite variance; empty if none is
    std::vector<UnobservableState> unobservable{};
  };
  static Parts compute(Problem& problem, std::span<const Pair> pairs, const Stop& stop, detail::Gauges gauges);

  Parts parts_;
};

}  // namespace tandem
