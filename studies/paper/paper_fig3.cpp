#include <cmath>
#include <numbers>
#include <random>

#include <tandem/lie/error.hpp>
#include <tandem/problem/problem.hpp>
#include <tandem/residuals/constant_twist.hpp>
#include <tandem/studies/paper/paper_fig3.hpp>

namespace tandem::fig3 {
namespace {

/// Returns a random pose about 1 m and 1 rad away from `pose`, in all directions.
SE3 displaced(const SE3& pose, std::mt19937_64& random) {
  std::uniform_real_distribution<double> metres(-1.2, 1.2), radians(-0.6, 0.6);
  SE3::Tangent delta;
  for (int i = 0; i < 3; ++i) delta[i] = metres(random);
  for (int i = 3; i < 6; ++i) delta[i] = radians(random);
  return pose * SE3::Exp(delta);
}

}  // namespace

SE3 arc_pose(double t) {
  const SE3 begin(SO3::Exp({0, 0, std::numbers::pi / 2}), {radius, 0, 0});
  SE3::Tangent twist;
  twist << speed, 0, 0, 0, 0, turn_rate;
  return begin * SE3::Exp(t * twist);
}

OffArc off_arc(const SE3& pose) {
  const Vector<3> p = pose.translation(), x_axis = pose.rotation().matrix().col(0);
  const Vector<3> tangent = Vector<3>(-p.y(), p.x(), 0).normalized();
  return {std::hypot(p.head<2>().norm() - radius, p.z()),
          std::atan2(x_axis.cross(tangent).norm(), x_axis.dot(tangent))};
}

std::vector<Panel> panels() {
  constexpr bool given = true, unknown = false;
  return {{"(a) extrapolation", {{0.0, given}, {1.5, given}, {3.0, unknown}}},
          {"(b) interpolation", {{0.0, given}, {2.0, unknown}, {4.0, given}}},
          {"(c) chain", {{0, given}, {1, unknown}, {2, unknown}, {3, unknown}, {4, unknown}, {5, given}}}};
}

Solution solve(const Panel& panel, const AnySolver& solver, unsigned seed) {
  Solution result{panel, {}, {}, {}};
  std::mt19937_64 random(seed);

  // One variable per pose. The given poses are fixed: the solver does not change them.
  Problem problem;
  std::vector<Variable<SE3>> x;
  for (const auto& [t, given] : panel.poses) {
    result.start.push_back(given ? arc_pose(t) : displaced(arc_pose(t), random));
    x.push_back(problem.add(result.start.back()));
    if (given) problem.fix(x.back());
  }

  // The prior on every three consecutive poses. Its noise grows with the predicted time. Without measurements, the
  // noise does not change the solution, because the arc satisfies all priors exactly.
  const Gaussian noise_of_one_second = {0.01, 0.01, 0.01, 0.005, 0.005, 0.005};  // m, rad
  for (std::size_t k = 2; k < x.size(); ++k) {
    const double dt1 = panel.poses[k - 1].t - panel.poses[k - 2].t, dt2 = panel.poses[k].t - panel.poses[k - 1].t;
    problem.minimize(ConstantTwist<SE3>{dt1, dt2}, noise_of_one_second.scaled(std::sqrt(dt2)),
                     {x[k - 2], x[k - 1], x[k]});
  }

  // solve(problem, GaussNewtonOptions{}) selects a solver at compile time; here it is selected at run time.
  result.summary = std::visit([&](const auto& options) { return tandem::solve(problem, options); }, solver);
  if (result.summary.status == Status::unsupported) throw Error(result.summary.message);
  for (const Variable<SE3>& pose : x) result.solved.push_back(problem.value(pose));
  return result;
}

}  // namespace tandem::fig3
