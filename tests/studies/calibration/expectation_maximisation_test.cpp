#include <cmath>

#include <gtest/gtest.h>

#include <tandem/problem/nlp_evaluator.hpp>
#include <tandem/solvers/marginals.hpp>
#include <tandem/solvers/solver.hpp>
#include <tandem/studies/calibration/scenario_problems.hpp>
#include <tandem/studies/scenario/builtin_scenarios.hpp>

/// Compares the noise of all sensors with expectation maximisation (Dempster, Laird & Rubin 1977).
namespace tandem {
namespace {

/// Laplace's approximation of the log evidence, up to a constant that does not depend on the noise of the sensors.
double laplace(Problem& problem) { return -NlpEvaluator(problem).cost() - 0.5 * Marginals(problem).log_determinant(); }

/// The maximisation step sets σ² to the mean of r² + J S Jᵀ, so the estimate is where this step changes nothing.
TEST(ExpectationMaximisation, HasTheSameSensorNoiseOfDockingA) {
  const Scenario scenario = read_scenario(find_scenario("docking_a", builtin_scenarios()));
  ScenarioCalibrationOptions options;
  options.prior = 0;
  for (const TargetSensor& sensor : scenario.data.sensors) options.free.push_back(sensor.name);
  ScenarioProblems problems({scenario}, options);
  Problem& problem = *problems.raw_problems()[0];
  ASSERT_TRUE(solve(problem, GaussNewtonOptions{}).converged());
  CalibrationOptions calibration;
  calibration.measured = problems.measured();
  calibration.tolerance = 1e-4;
  const std::vector<NoiseGroup>& groups = problems.noise().groups;
  const Calibration found = calibrate(problem, groups, calibration);
  ASSERT_TRUE(found.converged()) << found.message;

  const double given = laplace(problem);
  apply(found, problem, groups);
  ASSERT_TRUE(solve(problem, GaussNewtonOptions{}).converged());
  double gain = laplace(problem) - given;
  const Marginals marginals(problem);
  for (std::size_t g = 0; g < groups.size(); ++g) {
    double sum = 0, rows = 0;
    for (const NoiseRows& of : groups[g].rows) {
      const Problem::Linearization at = problem.linearization(of.block);
      const Eigen::MatrixXd second_moment =
          at.residual * at.residual.transpose() + marginals.propagated(at.jacobian, at.variable_ids, at.dofs);
      const Eigen::MatrixXd information = problem.noise(of.block).covariance_matrix().inverse();
      sum += (information * second_moment).diagonal().segment(of.first, of.count).sum();
      rows += of.count;
    }
    EXPECT_NEAR(0.5 * std::log(sum / rows), 0, 1e-3) << groups[g].name;
    gain -= rows * std::log(found.noise[g].factor);
  }
  // calibrate() linearises the priors at the solution, which moves with the noise.
  EXPECT_NEAR(found.gain, gain, 0.05);
}

}  // namespace
}  // namespace tandem
