#pragma once

#include <string>
#include <vector>

#include <tandem/problem/nlp_evaluator.hpp>
#include <tandem/problem/stop.hpp>
#include <tandem/solvers/linear/block_cholesky.hpp>
#include <tandem/solvers/summary.hpp>

namespace tandem::detail {

/// Memory of a solver that this analysis overwrites.
struct Workspace {
  BlockCholesky& cholesky;
  Eigen::VectorXd& gradient;
  Eigen::VectorXd& hessian;
  bool has_hessian = false;  ///< whether `hessian` is the Gauss-Newton Hessian of the cost at X̄
};

/// Whether to search for gauges (solvers/gauge_search.hpp).
enum class Gauges { search, ignore };

/// A direction along which the cost is constant, or almost so.
struct FlatDirection {
  Eigen::VectorXd v;  ///< direction of norm 1
  /// An unknown that the direction moves. The unknowns of several null directions of the Hessian differ. If they are
  /// fixed, the Hessian becomes regular. −1 for a gauge.
  int unknown = -1;
  bool unobservable = true;  ///< false if the residuals observe the direction, but the factor lost it to rounding
};

/// Finds the flat directions of the problem at X̄. There are three kinds:
///
/// - Null directions of the Gauss-Newton Hessian JᵀJ. A pivot below 1e-12 of its diagonal entry is only an indication,
///   because long chains and loose priors cause it too. The criterion is the change of the residuals, ‖J v‖², which
///   keeps all digits. At most `most` directions of this and the next kind are found.
/// - Directions with ‖J v‖² > 0 that the factor of the Hessian cannot resolve.
/// - Gauges: JᵀJ has curvature, but the cost does not change. See GaugeSearch.
///
/// Active hard constraints count as information; active inequalities only if `inequalities` is true. Empty if a
/// residual is undefined. Throws Stopped if `stop` ends the search. `skipped` receives the number of further null
/// directions that the pivots indicate.
std::vector<FlatDirection> flat_directions(NlpEvaluator& nlp, const Workspace& work, bool inequalities, int most,
                                           const Stop& stop = {}, int* skipped = nullptr,
                                           Gauges with_gauges = Gauges::search);
/// Does the same, and allocates the workspace.
std::vector<FlatDirection> flat_directions(NlpEvaluator& nlp, bool inequalities, int most, const Stop& stop = {},
                                           int* skipped = nullptr, Gauges with_gauges = Gauges::search);

/// Returns the variables that unobservable directions move, with the names of the directions. An entry without a
/// variable counts the skipped ones.
std::vector<UnobservableState> unobservable_states(const NlpEvaluator& nlp, const std::vector<FlatDirection>& flat,
                                                   int skipped = 0);
/// Returns which unknowns have an infinite variance. An unknown counts if it takes part in an unobservable direction by
/// more than rounding, in units of the conditional standard deviations 1/√`curvature` of the unknowns.
std::vector<char> unobservable_unknowns(const std::vector<FlatDirection>& flat, const Eigen::VectorXd& curvature);

}  // namespace tandem::detail
