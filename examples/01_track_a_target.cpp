// Tracks a target with constant twist from one USBL fix per second: estimates its position and heading.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>
#include <vector>

#include <tandem/lie/se3.hpp>
#include <tandem/problem/problem.hpp>
#include <tandem/residuals/constant_twist.hpp>
#include <tandem/residuals/prior.hpp>
#include <tandem/residuals/twist_components.hpp>
#include <tandem/residuals/usbl_position.hpp>
#include <tandem/solvers/augmented_lagrangian.hpp>

using namespace tandem;

int main() {
  constexpr int n = 60;
  constexpr double dt = 1.0;  // s
  std::mt19937 random(1);
  std::normal_distribution<double> normal;

  // Simulation: the target turns left at 1.2 m/s. The chaser moves along x and measures its position with a standard
  // deviation of 0.5 m on each axis.
  const Vector<6> twist(1.2, 0.0, 0.0, 0.0, 0.0, 0.03);  // m/s, rad/s: translation first, along the body axes
  std::vector<SE3> chaser, target;
  std::vector<Vector<3>> fixes;  // in the chaser's body frame
  for (int k = 0; k < n; ++k) {
    chaser.push_back(SE3(SO3(), Vector<3>(0.8 * k * dt, 0.0, 0.0)));
    target.push_back(SE3(SO3::Exp({0.0, 0.0, 0.3}), Vector<3>(20.0, 5.0, -3.0)) * SE3::Exp(Vector<6>(k * dt * twist)));
    const Vector<3> noise(normal(random), normal(random), normal(random));
    fixes.push_back(chaser[k].inverse().act(target[k].translation()) + 0.5 * noise);
  }

  // Problem: the initial guess has the positions of the fixes and the direction of travel between them.
  Problem problem;
  std::vector<Variable<SE3>> c, t;
  for (int k = 0; k < n; ++k) {
    const int before = std::max(k - 5, 0), after = std::min(k + 5, n - 1);
    const Vector<3> way = chaser[after].act(fixes[after]) - chaser[before].act(fixes[before]);
    c.push_back(problem.add(chaser[k]));
    t.push_back(problem.add(SE3(SO3::Exp({0.0, 0.0, std::atan2(way.y(), way.x())}), chaser[k].act(fixes[k]))));
    problem.minimize(Prior<SE3>{chaser[k]}, Gaussian{0.05, 0.05, 0.05, 0.005, 0.005, 0.005}, {c[k]});
    problem.minimize(UsblPosition<>{fixes[k]}, Gaussian{0.5, 0.5, 0.5}, {c[k], t[k]}, Cauchy(3.0));
    if (k >= 1)  // like a ship: no sway, heave, roll or pitch
      problem.subject_to(TwistComponents<SE3, sway | heave | roll_rate | pitch_rate>{dt}, equal_to(0.0),
                         {t[k - 1], t[k]});
    if (k >= 2)
      problem.minimize(ConstantTwist<SE3>{dt, dt}, Gaussian{0.1, 0.1, 0.1, 0.01, 0.01, 0.01},
                       {t[k - 2], t[k - 1], t[k]});
  }
  // The fixes contain no information about the roll angle around the direction of travel.
  problem.minimize(Prior<SE3>{target[0]}, Gaussian{10.0, 10.0, 10.0, 0.01, 0.01, 1.0}, {t[0]});

  const Summary summary = solve(problem, AugmentedLagrangianOptions{});
  double fixed = 0.0, estimated = 0.0, heading = 0.0;
  for (int k = 0; k < n; ++k) {
    const SE3 error = target[k].inverse() * problem.value(t[k]);
    fixed += (chaser[k].act(fixes[k]) - target[k].translation()).norm() / n;
    estimated += error.translation().norm() / n;
    heading += error.rotation().Log().norm() / n;
  }
  std::printf(
      "%s\nmean error of the fixes: %.3f m; of the estimate: %.3f m and %.4f rad; sway and heave below %.1e m/s\n",
      summary.message.c_str(), fixed, estimated, heading, summary.max_violation);
  return summary.converged() && estimated < 0.5 * fixed && heading < 0.1 && summary.max_violation < 1e-6 ? 0 : 1;
}
