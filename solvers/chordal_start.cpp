#include <string>
#include <utility>

#include <Eigen/SVD>

#include <tandem/lie/error.hpp>
#include <tandem/lie/rn.hpp>
#include <tandem/problem/problem.hpp>
#include <tandem/solvers/chordal_start.hpp>
#include <tandem/solvers/gauss_newton.hpp>

namespace tandem {
namespace {

/// Residual y − Zᵀ x − d. It relates a row of R_to (y) to that of R_from (x) by the measured rotation Z, or two
/// positions by their difference d.
template <int n>
struct LinearStep {
  static constexpr std::string_view name = "linear step";
  static constexpr int dim = n;
  static constexpr bool linear = true;
  using States = std::tuple<Rn<n>, Rn<n>>;

  Matrix<n, n> Z;
  Vector<n> d;

  void operator()(const Rn<n>& x, const Rn<n>& y, Vector<n>& r, Matrix<n, n>* Jx = nullptr,
                  Matrix<n, n>* Jy = nullptr) const {
    r = y.vector() - Z.transpose() * x.vector() - d;
    if (Jx) *Jx = -Z.transpose();
    if (Jy) Jy->setIdentity();
  }
};

/// Returns the rotation that is nearest to a matrix.
template <int n>
Matrix<n, n> nearest_rotation(const Matrix<n, n>& M) {
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(M, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Vector<n> signs = Vector<n>::Ones();
  signs[n - 1] = svd.matrixU().determinant() * svd.matrixV().determinant() < 0 ? -1 : 1;
  return svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
}

/// Throws BadInputError unless the edges connect all poses.
template <LieGroup G>
void check_connected(int poses, std::span<const PoseEdge<G>> edges) {
  std::vector<int> parent(std::size_t(poses), 0);
  for (int i = 0; i < poses; ++i) parent[std::size_t(i)] = i;
  const auto root = [&](int i) {
    while (parent[std::size_t(i)] != i)
      i = std::exchange(parent[std::size_t(i)], parent[std::size_t(parent[std::size_t(i)])]);
    return i;
  };
  for (const PoseEdge<G>& edge : edges) {
    for (const int end : {edge.from, edge.to})
      if (end < 0 || end >= poses)
        throw BadInputError("an edge refers to pose " + std::to_string(end) + ", but the graph has " +
                            std::to_string(poses) + " poses");
    parent[std::size_t(root(edge.from))] = root(edge.to);
  }
  for (int i = 0; i < poses; ++i)
    if (root(i) != root(0)) throw BadInputError("no edges connect pose " + std::to_string(i) + " to pose 0");
}

/// Returns the solution of linear equations between the ends of edges, with pose 0 at `first`.
template <int n, LieGroup G, class Step, class Weight>
std::vector<Vector<n>> solve_between(int poses, std::span<const PoseEdge<G>> edges, const Vector<n>& first, Step step,
                                     Weight weight) {
  Problem problem;
  std::vector<Variable<Rn<n>>> x;
  for (int i = 0; i < poses; ++i) x.push_back(problem.add(Rn<n>(first)));
  problem.fix(x[0]);
  for (const PoseEdge<G>& edge : edges)
    problem.minimize(LinearStep<n>(step(edge)), Gaussian(Vector<n>::Constant(1 / std::sqrt(weight(edge)))),
                     {x[std::size_t(edge.from)], x[std::size_t(edge.to)]});
  solve(problem, GaussNewtonOptions{});
  std::vector<Vector<n>> solution;
  for (const Variable<Rn<n>>& variable : x) solution.push_back(problem.value(variable).vector());
  return solution;
}

}  // namespace

template <LieGroup G>
std::vector<G> chordal_start(int poses, std::span<const PoseEdge<G>> edges, const G& first) {
  constexpr int n = G::point_dim;
  if (poses == 0) return {};
  check_connected(poses, edges);
  const auto mean_information = [](const PoseEdge<G>& edge, int begin, int size) {
    return edge.noise.sqrt_information().middleCols(begin, size).squaredNorm() / size;
  };
  std::vector<Matrix<n, n>> R(std::size_t(poses), Matrix<n, n>::Zero());
  for (int row = 0; row < n; ++row) {
    const auto solution = solve_between<n>(
        poses, edges, Vector<n>(first.rotation().matrix().row(row).transpose()),
        [](const PoseEdge<G>& edge) {
          return LinearStep<n>{edge.z.rotation().matrix(), Vector<n>::Zero()};
        },
        [&](const PoseEdge<G>& edge) { return mean_information(edge, n, G::dof - n); });
    for (std::size_t i = 0; i < R.size(); ++i) R[i].row(row) = solution[i].transpose();
  }
  for (Matrix<n, n>& matrix : R) matrix = nearest_rotation<n>(matrix);
  const auto t = solve_between<n>(
      poses, edges, Vector<n>(first.translation()),
      [&](const PoseEdge<G>& edge) {
        return LinearStep<n>{Matrix<n, n>::Identity(), R[std::size_t(edge.from)] * edge.z.translation()};
      },
      [&](const PoseEdge<G>& edge) { return mean_information(edge, 0, n); });
  std::vector<G> result;
  using Rotation = std::remove_cvref_t<decltype(first.rotation())>;
  for (std::size_t i = 0; i < R.size(); ++i) {
    if constexpr (n == 2)
      result.emplace_back(Rotation(std::atan2(R[i](1, 0), R[i](0, 0))), t[i]);
    else
      result.emplace_back(Rotation(R[i]), t[i]);
  }
  result[0] = first;
  return result;
}

template std::vector<SE2> chordal_start(int, std::span<const PoseEdge<SE2>>, const SE2&);
template std::vector<SE3> chordal_start(int, std::span<const PoseEdge<SE3>>, const SE3&);

}  // namespace tandem
