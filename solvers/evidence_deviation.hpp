#pragma once

#include <optional>
#include <vector>

#include <tandem/lie/rn.hpp>
#include <tandem/problem/problem.hpp>
#include <tandem/problem/stop.hpp>

namespace tandem {

/// The standard deviation of a variable of one dimension by the curvature of the Laplace evidence of a solved problem along it,
/// −F − ½ log det H of all others at their best: by differences to either side, over `step` first and then over what comes
/// out, at most `most`; infinite where the evidence does not fall. Marginals linearise the cost where it is, which is not enough
/// of a variable that decides how much noise of the others a measurement shows, such as a delay among keyframes: F then bends
/// more than by its Gauss-Newton Hessian, and log det H the other way. Nothing where there are hard blocks, or a solve to
/// either side does not converge or leaves a direction free; throws Stopped where it is to stop.
std::optional<double> evidence_deviation(const Problem& solved, const Variable<Rn<1>>& x, double step, double most,
                                         const Stop& stop = {});

/// That evidence at other values of the variable, against the one where it is; NaN where a solve there does not converge or
/// leaves a direction free. Empty where there are hard blocks; throws Stopped where it is to stop.
std::vector<double> evidence_along(const Problem& solved, const Variable<Rn<1>>& x, const std::vector<double>& values,
                                   const Stop& stop = {});

}  // namespace tandem
