#pragma once

#include <string>
#include <variant>
#include <vector>

#include <tandem/solvers/gauss_newton.hpp>
#include <tandem/solvers/ipopt.hpp>
#include <tandem/solvers/nlopt.hpp>
#include <tandem/studies/metrics.hpp>
#include <tandem/studies/scenario.hpp>

namespace tandem {

/// A solver with its options.
using Solver = std::variant<GaussNewtonOptions, IpoptOptions, NloptOptions>;

/// What estimating a scenario gave.
struct Estimate {
  std::string scenario;
  std::string mode = "A";
  Summary summary;
  int residual_blocks = 0;  ///< soft ones
  int hard_blocks = 0;
  std::vector<Keyframe> keyframes;
  std::vector<SE3> chaser, target;    ///< one each a keyframe
  std::vector<KeyframeError> errors;  ///< one a keyframe
};

/// Builds the tracking problem, solves it and compares with the truth. Throws Error when data and options
/// make no problem or the solver cannot take it; a solve that does not converge is in the summary.
Estimate estimate(const Scenario& scenario, const TrackingOptions& options, const Solver& solver);

}  // namespace tandem
