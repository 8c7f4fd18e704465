// Exchanges Eigen objects with the library, which allocates and frees them in its own way. Compiled for AVX2.
#include <cstdio>
#include <vector>

#include <Eigen/Dense>

#include <tandem/lie/se3.hpp>
#include <tandem/problem/problem.hpp>
#include <tandem/residuals/prior.hpp>
#include <tandem/solvers/augmented_lagrangian.hpp>
#include <tandem/solvers/gauss_newton.hpp>
#include <tandem/solvers/marginals.hpp>

int main() {
  if (!__builtin_cpu_supports("avx2") || !__builtin_cpu_supports("fma")) return 77;
  using tandem::SE3;
  tandem::Problem problem;
  std::vector<tandem::Variable<SE3>> poses;
  for (int i = 0; i < 100; ++i) poses.push_back(problem.add(SE3(), "pose"));
  const Eigen::MatrixXd random = Eigen::MatrixXd::Random(6, 6);
  const Eigen::MatrixXd covariance = random * random.transpose() + Eigen::MatrixXd::Identity(6, 6);
  for (const auto& pose : poses)
    problem.minimize(tandem::Prior<SE3>{SE3(tandem::SO3(), {1, 2, 3})}, tandem::Gaussian::covariance(covariance),
                     {pose});
  const auto bound = problem.subject_to(tandem::Prior<SE3>{}, tandem::at_most(2.5), {poses[0]});
  problem.set_multipliers(bound, Eigen::VectorXd::Zero(6));
  const tandem::Summary summary = solve(problem, tandem::AugmentedLagrangianOptions{});
  const Eigen::VectorXd multipliers = problem.multipliers(bound);  // allocated by the library, freed here
  Eigen::MatrixXd noise = problem.noise(problem.blocks()[0]).covariance_matrix();
  noise = noise * Eigen::MatrixXd::Identity(6, 6);
  const tandem::Marginals marginals(problem);
  const double error = (marginals.covariance(poses[5]) - covariance).norm() / covariance.norm();
  std::printf("%s multiplier %g, error of a covariance %g\n", summary.message.c_str(), multipliers[2], error);
  return summary.converged() && multipliers[2] > 0 && (noise - covariance).norm() < 1e-9 && error < 1e-6 ? 0 : 1;
}
