// Adds a user-defined sensor: two hydrophones receive the same ping, and the delay gives the difference of their
// ranges. The residual is one struct. Its Jacobian is checked against differences, and it joins a problem like any
// other residual.
#include <cstdio>
#include <vector>

#include <tandem/lie/rn.hpp>
#include <tandem/problem/problem.hpp>
#include <tandem/residuals/residual.hpp>
#include <tandem/residuals/testing.hpp>
#include <tandem/solvers/gauss_newton.hpp>

using namespace tandem;

/// Range of a point from hydrophone b minus its range from hydrophone a [m]:  r = ‖p − b‖ − ‖p − a‖ − z
struct RangeDifference {
  static constexpr std::string_view name = "range difference";
  static constexpr int dim = 1;
  using States = std::tuple<R3>;

  double z;        ///< delay times speed of sound [m]
  Vector<3> a, b;  ///< positions of the hydrophones [m]

  void operator()(const R3& p, Vector<1>& r, Matrix<1, 3>* J = nullptr) const {
    const Vector<3> from_a = p.vector() - a, from_b = p.vector() - b;
    r[0] = from_b.norm() - from_a.norm() - z;
    if (J) *J = (from_b.normalized() - from_a.normalized()).transpose();
  }
};

int main() {
  // Checks the Jacobian. This finds wrong signs, missing terms and entries that are not set.
  const RangeDifference example{0.3, Vector<3>(1.0, 2.0, 0.0), Vector<3>(-4.0, 0.5, 1.0)};
  const JacobianReport report = check_jacobians_at_random(example, 1, 100);
  std::printf("largest Jacobian error: %.1e (%s)\n", report.relative, report.text.c_str());
  if (report.relative > 1e-8) return 1;

  // Five hydrophones on a frame of 10 m give the delays to the first one and thus the position of the pinger.
  const std::vector<Vector<3>> hydrophones = {{0, 0, 0}, {10, 0, 0}, {0, 10, 0}, {10, 10, -1}, {5, 5, -4}};
  const Vector<3> truth(12.0, -7.0, -20.0);
  Problem problem;
  const Variable<R3> pinger = problem.add(R3(Vector<3>(5.0, 0.0, -10.0)), "pinger");
  for (std::size_t i = 1; i < hydrophones.size(); ++i) {
    const double farther = (truth - hydrophones[i]).norm() - (truth - hydrophones[0]).norm();
    problem.minimize(RangeDifference{farther, hydrophones[0], hydrophones[i]}, Gaussian{0.01}, {pinger});
  }
  const Summary summary = solve(problem, GaussNewtonOptions{});
  const Vector<3> found = problem.value(pinger).vector();
  std::printf("pinger at %.3f %.3f %.3f m: %s\n", found.x(), found.y(), found.z(), summary.message.c_str());
  return summary.converged() && (found - truth).norm() < 1e-3 ? 0 : 1;
}
