// A residual without a Jacobian: the formula alone, differentiated by AutoDiff.
#include <cmath>
#include <cstdio>
#include <vector>

#include <tandem/lie/rn.hpp>
#include <tandem/lie/se2.hpp>
#include <tandem/problem/problem.hpp>
#include <tandem/residuals/auto_diff.hpp>
#include <tandem/solvers/gauss_newton.hpp>

using namespace tandem;

/// Azimuth and elevation of a lamp in the frame of a boat [rad]. The height of the lamp above the camera is known.
struct LampDirection {
  static constexpr std::string_view name = "lamp direction";
  static constexpr int dim = 2;
  using States = std::tuple<SE2, R2>;

  double azimuth, elevation, height;  ///< rad, rad, m

  template <class S>
  Vector<2, S> operator()(const BasicSE2<S>& boat, const BasicRn<2, S>& lamp) const {
    using std::atan2;
    const Vector<2, S> p = boat.inverse().act(lamp.vector());
    return {atan2(p.y(), p.x()) - azimuth, atan2(S(height), p.norm()) - elevation};
  }
};

int main() {
  // Two lamps at known positions fix the position and the heading of the boat.
  const SE2 truth(SO2(0.3), Vector<2>(2.0, -1.0));
  const double height = 8.0;
  Problem problem;
  const Variable<SE2> boat = problem.add(SE2(), "boat");
  for (const Vector<2>& at : std::vector<Vector<2>>{{20.0, 5.0}, {25.0, -15.0}}) {
    const Variable<R2> lamp = problem.add(R2(at), "lamp");
    problem.fix(lamp);
    const Vector<2> p = truth.inverse().act(at);
    const LampDirection seen{std::atan2(p.y(), p.x()), std::atan2(height, p.norm()), height};
    problem.minimize(AutoDiff{seen}, Gaussian{1e-3, 1e-3}, {boat, lamp});
  }
  const Summary summary = solve(problem, GaussNewtonOptions{});
  const double error = (truth.inverse() * problem.value(boat)).Log().norm();
  std::printf("boat found to %.1e: %s\n", error, summary.message.c_str());
  return summary.converged() && error < 1e-6 ? 0 : 1;
}
