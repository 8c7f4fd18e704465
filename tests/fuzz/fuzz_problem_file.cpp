#include <tandem/problem/file/problem_file.hpp>
#include <tandem/residuals/bearing.hpp>
#include <tandem/residuals/soft_bound.hpp>
#include <tandem/residuals/twist_components.hpp>
#include <tandem/solvers/augmented_lagrangian.hpp>

#include "fuzz/handles.hpp"

namespace {

using namespace tandem;

/// Problem with all types that the files contain, so that they are compiled into this program.
Problem problem_of_all_types() {
  Problem problem;
  const auto x = problem.add(SE3(), "x"), y = problem.add(SE3(), "y");
  const auto s = problem.add(SE2(), "s");
  const auto p = problem.add(R2(), "p");
  const auto r = problem.add(fuzz::R1(), "r");
  problem.minimize(Prior<SE3>{SE3()}, Gaussian(Vector<6>::Ones()), {x});
  problem.minimize(RelativePose<SE3>{SE3()}, Gaussian(Vector<6>::Ones()), {x, y});
  problem.minimize(Bearing<SE2, R2>{Direction<2>(0.0)}, Gaussian{1.0}, {s, p}, Cauchy(1.0));
  problem.minimize(SoftBound{TwistComponents<SE3, surge>{1.0}, at_least(0.0)}, Gaussian{1.0}, {x, y});
  problem.minimize(Prior<fuzz::R1>{fuzz::R1()}, Gaussian{1.0}, {r});
  problem.subject_to(Prior<fuzz::R1>{fuzz::R1()}, at_most(1.0), {r});
  problem.subject_to(TwistComponents<SE3, surge>{1.0}, at_least(0.0), {x, y});
  return problem;
}

}  // namespace

// A problem file. A valid one is written as it was read and can be solved; others are rejected.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::string all = problem_text(problem_of_all_types());
  fuzz::expect(!all.empty(), "the problem of all types has a text");
  fuzz::Input input(data, size);
  fuzz::accepts([&] {
    Problem problem = parse_problem(input.text(), "problem.json");
    const std::string text = problem_text(problem);
    fuzz::expect(problem_text(parse_problem(text, "again")) == text, "writing and reading keep the text");
    fuzz::expect(problem_text(problem.copy()) == text, "a copy has the same text");
    AugmentedLagrangianOptions options;
    options.max_iterations = 3;
    const Summary summary = solve(problem, options);
    fuzz::expect(!summary.message.empty(), "a solve has a message");
  });
  return 0;
}
