// Estimates one pose from two priors with each solver of the installed package.
#include <cmath>
#include <iostream>
#include <string>

#include <tandem/lie/se3.hpp>
#include <tandem/problem/problem.hpp>
#include <tandem/residuals/prior.hpp>
#include <tandem/solvers/gauss_newton.hpp>
#include <tandem/solvers/ipopt.hpp>
#include <tandem/solvers/nlopt.hpp>

namespace {

using tandem::SE3;
using tandem::Vector;

// Two equal priors at x = 1 and x = 3 give the estimate x = 2.
template <class Options>
bool estimates(const std::string& name, const Options& options, bool present) {
  const auto at = [](double x) { return SE3::Exp(Vector<6>(x * Vector<6>::Unit(0))); };
  const tandem::Gaussian noise(Vector<6>::Constant(0.1));
  tandem::Problem problem;
  const auto pose = problem.add(at(0.0));
  problem.minimize(tandem::Prior<SE3>{at(1.0)}, noise, {pose});
  problem.minimize(tandem::Prior<SE3>{at(3.0)}, noise, {pose});

  if (const std::string why = why_unsupported(problem, options); !why.empty()) {
    std::cout << name << ": " << why << "\n";
    return !present;
  }
  const tandem::Summary summary = solve(problem, options);
  const double x = problem.value(pose).Log()[0];
  std::cout << name << ": x = " << x << ", " << summary.message << "\n";
  return summary.converged() && std::abs(x - 2.0) < 1e-6;
}

}  // namespace

int main() {
  const bool gauss_newton = estimates("gauss-newton", tandem::GaussNewtonOptions{}, true);
  const bool ipopt = estimates("ipopt", tandem::IpoptOptions{}, HAS_IPOPT);
  const bool nlopt = estimates("nlopt", tandem::NloptOptions{}, HAS_NLOPT);
  return gauss_newton && ipopt && nlopt ? 0 : 1;
}
