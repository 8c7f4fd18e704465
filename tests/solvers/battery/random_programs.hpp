#pragma once

#include <string>
#include <vector>

#include "solvers/random_problems.hpp"

/// Provides random nonconvex problems, each with one kind of difficulty.
namespace tandem::testing {

enum class Difficulty {
  nonconvex,         ///< None but curvature of both signs.
  only_constraints,  ///< Variables that only constraints read.
  redundant,         ///< Equalities that follow from others, sometimes more than unknowns.
  degenerate,        ///< Vanishing gradients of constraints, and more active constraints than unknowns.
  badly_scaled,      ///< Variables in units from 1e-3 to 1e3, rows from 1e-4 to 1e4.
  large_rows,        ///< Variables in units of 1e-3 or 1e3, rows in units of 1e-6, 1e3 or 1e6.
  infeasible,        ///< Contradictory constraints.
};
inline constexpr Difficulty kDifficulties[] = {
    Difficulty::nonconvex,    Difficulty::only_constraints, Difficulty::redundant, Difficulty::degenerate,
    Difficulty::badly_scaled, Difficulty::large_rows,       Difficulty::infeasible};

inline std::string name_of(Difficulty difficulty) {
  constexpr const char* names[] = {"nonconvex",    "only_constraints", "redundant", "degenerate",
                                   "badly_scaled", "large_rows",       "infeasible"};
  return names[int(difficulty)];
}

/// Returns random_problem(seed) with one difficulty added.
RandomProblem random_program(Difficulty difficulty, std::uint64_t seed);

}  // namespace tandem::testing
