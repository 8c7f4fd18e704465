#include <algorithm>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/solvers/marginals.hpp>
#include <tandem/studies/calibration/degrees_of_freedom_check.hpp>

namespace tandem {
namespace {

// Maximum leverage: share of the noise variance that the estimated states absorb.
constexpr double kMaxLeverage = 1.0 / 3;
constexpr double kMaxLeverageWithConstraints = 0.2;  // without the tail correction

}  // namespace

void check_degrees_of_freedom(const CalibrationProblems& problems, const std::vector<ModelParameter>& parameters,
                              const Stop& stop) try {
  if (std::all_of(parameters.begin(), parameters.end(), [](const ModelParameter& p) { return p.time; })) return;
  std::vector<double> leverage(parameters.size(), 0.0), rows(parameters.size(), 0.0);
  bool hard = false;
  for (const auto& built : problems) {
    Problem& problem = built->problem();
    hard = hard || problem.num_hard_blocks() > 0;
    const Marginals marginals = Marginals::without_gauges(problem, stop);
    for (const EntryBlock& b : built->blocks)
      for (std::size_t i = 0; i < parameters.size(); ++i) {
        if (parameters[i].time || parameters[i].entry != built->entries[b.entry].name + ".dof") continue;
        const Problem::Linearization at = problem.linearization(b.block);
        const Eigen::MatrixXd J = problem.noise(b.block).sqrt_information() * at.jacobian;
        leverage[i] += problem.weight(b.block) * marginals.propagated(J, at.variable_ids, at.dofs).trace();
        rows[i] += double(J.rows());
      }
  }
  for (std::size_t i = 0; i < parameters.size(); ++i)
    if (leverage[i] > (hard ? kMaxLeverageWithConstraints : kMaxLeverage) * rows[i])
      throw Error(
          fmt::format("--free {}: not identifiable, since the estimated states absorb {:.0f} % of this noise; remove "
                      "it from --free",
                      parameters[i].name, 100 * leverage[i] / rows[i]));
} catch (const Stopped&) {
}

}  // namespace tandem
