/// Pose graphs with an initial guess from odometry: gauss_newton against Ceres with SuiteSparse, with the same residual
/// code. Solves a simulated sphere of 2,500 poses and a planar graph of 20,000 with loops, or the graph of a g2o file.
///
///   bench_pose_graph [FILE.g2o 2|3]

#include <chrono>
#include <cstdio>

#include <ceres/ceres.h>
#include <fmt/format.h>

#include <tandem/residuals/relative_pose.hpp>
#include <tandem/solvers/gauss_newton.hpp>

#include "pose_graph.hpp"

namespace {

using namespace tandem;
using namespace tandem::bench;

double seconds() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

/// Parameter block of a pose in Ceres: cos sin x y, or qx qy qz qw x y z. Jacobians are in tangent coordinates: the
/// first dof columns are ∂/∂δ, and PlusJacobian selects them.
template <LieGroup G>
struct CeresBlock {
  static constexpr int size = G::dof == 3 ? 4 : 7;
  using Values = std::array<double, std::size_t(size)>;
  static Values from(const G& x) {
    if constexpr (G::dof == 3) {
      const auto R = x.rotation().matrix();
      return {R(0, 0), R(1, 0), x.translation()[0], x.translation()[1]};
    } else {
      const auto& q = x.rotation().quaternion();
      const Vector<3> t = x.translation();
      return {q.x(), q.y(), q.z(), q.w(), t[0], t[1], t[2]};
    }
  }
  static G to(const double* p) {
    if constexpr (G::dof == 3) {
      return G(SO2(std::atan2(p[1], p[0])), Vector<2>(p[2], p[3]));
    } else {
      return G(SO3(Eigen::Quaterniond(p[3], p[0], p[1], p[2])), Vector<3>(p[4], p[5], p[6]));
    }
  }
};

template <LieGroup G>
class Manifold final : public ceres::Manifold {
 public:
  int AmbientSize() const override { return CeresBlock<G>::size; }
  int TangentSize() const override { return G::dof; }
  bool Plus(const double* x, const double* delta, double* y) const override {
    const auto moved = CeresBlock<G>::from(CeresBlock<G>::to(x) * G::Exp(Eigen::Map<const typename G::Tangent>(delta)));
    std::copy(moved.begin(), moved.end(), y);
    return true;
  }
  bool PlusJacobian(const double*, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, CeresBlock<G>::size, G::dof, Eigen::RowMajor>>(jacobian).setIdentity();
    return true;
  }
  bool Minus(const double* y, const double* x, double* delta) const override {
    Eigen::Map<typename G::Tangent>(delta).noalias() = (CeresBlock<G>::to(x).inverse() * CeresBlock<G>::to(y)).Log();
    return true;
  }
  bool MinusJacobian(const double*, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, G::dof, CeresBlock<G>::size, Eigen::RowMajor>>(jacobian).setIdentity();
    return true;
  }
};

template <LieGroup G>
class EdgeCost final : public ceres::CostFunction {
 public:
  explicit EdgeCost(const PoseEdge<G>& edge) : residual_{edge.z}, W_(edge.noise.sqrt_information()) {
    set_num_residuals(G::dof);
    mutable_parameter_block_sizes()->assign(2, CeresBlock<G>::size);
  }
  bool Evaluate(double const* const* x, double* residuals, double** jacobians) const override {
    typename G::Tangent r;
    std::array<Matrix<G::dof, G::dof>, 2> J;
    const auto wanted = [&](std::size_t s) { return jacobians && jacobians[s] ? &J[s] : nullptr; };
    residual_(CeresBlock<G>::to(x[0]), CeresBlock<G>::to(x[1]), r, wanted(0), wanted(1));
    Eigen::Map<typename G::Tangent>(residuals).noalias() = W_ * r;
    for (const std::size_t s : {0, 1}) {
      if (!wanted(s)) continue;
      Eigen::Map<Eigen::Matrix<double, G::dof, CeresBlock<G>::size, Eigen::RowMajor>> out(jacobians[s]);
      out.setZero();
      out.template leftCols<G::dof>() = W_ * J[s];
    }
    return true;
  }

 private:
  RelativePose<G> residual_;
  Matrix<G::dof, G::dof> W_;
};

template <LieGroup G>
void solve_by_ceres(const PoseGraph<G>& graph) {
  std::vector<typename CeresBlock<G>::Values> x;
  for (const G& pose : graph.start) x.push_back(CeresBlock<G>::from(pose));
  ceres::Problem problem;
  for (auto& pose : x) problem.AddParameterBlock(pose.data(), CeresBlock<G>::size, new Manifold<G>);
  problem.SetParameterBlockConstant(x[0].data());
  for (const auto& edge : graph.edges)
    problem.AddResidualBlock(new EdgeCost<G>(edge), nullptr, x[std::size_t(edge.from)].data(),
                             x[std::size_t(edge.to)].data());
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  options.num_threads = 2;
  options.max_num_iterations = 1000;
  options.function_tolerance = options.gradient_tolerance = options.parameter_tolerance = 1e-10;
  ceres::Solver::Summary summary;
  const double begun = seconds();
  ceres::Solve(options, &problem, &summary);
  fmt::print("  ceres         {:<14} {:.9g} in {:.3f} s, {} iterations\n",
             summary.IsSolutionUsable() ? "usable" : "failed", summary.final_cost, seconds() - begun,
             summary.num_successful_steps + summary.num_unsuccessful_steps);
}

template <LieGroup G>
void solve_by_tandem(const PoseGraph<G>& graph, const std::vector<G>& start, const char* from) {
  Problem problem;
  std::vector<Variable<G>> x;
  for (const G& pose : start) x.push_back(problem.add(pose));
  problem.fix(x[0]);
  for (const auto& edge : graph.edges)
    problem.minimize(RelativePose<G>{edge.z}, edge.noise, {x[std::size_t(edge.from)], x[std::size_t(edge.to)]});
  const Summary s = solve(problem, GaussNewtonOptions{});
  fmt::print("  gauss-newton  {:<14} {:.9g} in {:.3f} s, {} iterations from {} with cost {:.6g}\n",
             tandem::name(s.status), s.cost, s.seconds, s.iterations, from, s.initial_cost);
}

template <LieGroup G>
void compare(const char* name, const PoseGraph<G>& graph) {
  fmt::print("{}: {} poses, {} edges\n", name, graph.start.size(), graph.edges.size());
  solve_by_tandem(graph, graph.start, "odometry");
  const double begun = seconds();
  const std::vector<G> chordal = chordal_start<G>(int(graph.start.size()), graph.edges, graph.start[0]);
  fmt::print("  chordal start in {:.3f} s\n", seconds() - begun);
  solve_by_tandem(graph, chordal, "the chordal start");
  solve_by_ceres(graph);
}

}  // namespace

int main(int count, char** arguments) try {
  if (count == 3 && std::string(arguments[2]) == "2") {
    compare(arguments[1], read_g2o<SE2>(arguments[1]));
  } else if (count == 3 && std::string(arguments[2]) == "3") {
    compare(arguments[1], read_g2o<SE3>(arguments[1]));
  } else if (count == 1) {
    compare("sphere", simulated_sphere(50));
    compare("plane", simulated_plane(20000));
  } else {
    std::fputs("usage: bench_pose_graph [FILE.g2o 2|3]\n", stderr);
    return 2;
  }
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "bench_pose_graph: %s\n", error.what());
  return 2;
}
