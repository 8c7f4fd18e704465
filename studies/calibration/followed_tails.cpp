#include <algorithm>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/solvers/marginals.hpp>
#include <tandem/studies/calibration/followed_tails.hpp>

namespace tandem {
namespace {

constexpr double kMostTaken = 1.0 / 3;       // of the noise's variance
constexpr double kMostTakenUnderHard = 0.2;  // by Laplace's approximation alone

}  // namespace

void refuse_followed_tails(const CalibrationProblems& problems, const std::vector<ScenarioNumber>& numbers,
                           const Stop& stop) try {
  if (std::all_of(numbers.begin(), numbers.end(), [](const ScenarioNumber& n) { return n.time; })) return;
  std::vector<double> taken(numbers.size(), 0.0), rows(numbers.size(), 0.0);
  bool hard = false;
  for (const auto& built : problems) {
    Problem& problem = built->problem();
    hard = hard || problem.num_hard_blocks() > 0;
    const Marginals marginals(problem, {}, stop);
    for (const EntryBlock& b : built->blocks)
      for (std::size_t i = 0; i < numbers.size(); ++i) {
        if (numbers[i].time || numbers[i].entry != built->entries[b.entry].name + ".dof") continue;
        const Problem::Linearization at = problem.linearization(b.block);
        const Eigen::MatrixXd J = problem.noise(b.block).sqrt_information() * at.jacobian;
        taken[i] += problem.weight(b.block) * (J * marginals.joint(at.variable_ids, at.dofs) * J.transpose()).trace();
        rows[i] += double(J.rows());
      }
  }
  for (std::size_t i = 0; i < numbers.size(); ++i)
    if (taken[i] > (hard ? kMostTakenUnderHard : kMostTaken) * rows[i])
      throw Error(fmt::format(
          "--free {}: the states follow {:.0f} % of this noise, and its tails with it, by the noise as given: "
          "what is left does not tell them; leave it out",
          numbers[i].name, 100 * taken[i] / rows[i]));
} catch (const Stopped&) {
}

}  // namespace tandem
