#pragma once

#include <variant>

#include <tandem/solvers/augmented_lagrangian.hpp>
#include <tandem/solvers/gauss_newton.hpp>
#include <tandem/solvers/ipopt.hpp>
#include <tandem/solvers/nlopt.hpp>

namespace tandem {

/// A solver with its options.
using Solver = std::variant<GaussNewtonOptions, AugmentedLagrangianOptions, IpoptOptions, NloptOptions>;

}  // namespace tandem
