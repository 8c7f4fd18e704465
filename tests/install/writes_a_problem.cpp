// Writes a problem with a user-defined residual, reads it back and solves both.
#include <iostream>
#include <tuple>

#include <tandem/problem/file/problem_file.hpp>
#include <tandem/residuals/prior.hpp>
#include <tandem/solvers/gauss_newton.hpp>

namespace {

/// Distance of a point from a circle about the origin [m], negative inside.
struct Circle {
  static constexpr std::string_view name = "circle";
  static constexpr int dim = 1;
  using States = std::tuple<tandem::R2>;
  double radius;
  auto fields() { return std::tie(radius); }  // stores it in files
  void operator()(const tandem::R2& x, tandem::Vector<1>& r, tandem::Matrix<1, 2>* J = nullptr) const {
    r[0] = x.vector().norm() - radius;
    if (J) *J = x.vector().normalized().transpose();
  }
};

}  // namespace

int main() {
  using namespace tandem;
  Problem problem;
  const auto x = problem.add(R2({1, 2}), "x");
  problem.minimize(Circle{3}, Gaussian{0.1}, {x});
  problem.minimize(Prior<R2>{R2({2, 2})}, Gaussian{1.0, 1.0}, {x});
  write_problem(problem, "problem.json");
  Problem read = read_problem("problem.json");
  const double cost = solve(problem, GaussNewtonOptions{}).cost, cost_read = solve(read, GaussNewtonOptions{}).cost;
  std::cout << "cost " << cost << ", read " << cost_read << "\n";
  return cost == cost_read && read.value(read.variables<R2>()[0]).vector() == problem.value(x).vector() ? 0 : 1;
}
