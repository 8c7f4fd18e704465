#pragma once

#include <cmath>
#include <fstream>
#include <numbers>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include <tandem/lie/error.hpp>
#include <tandem/lie/se2.hpp>
#include <tandem/lie/se3.hpp>
#include <tandem/solvers/chordal_start.hpp>

namespace tandem::bench {

/// Pose graph. The first pose is fixed.
template <LieGroup G>
struct PoseGraph {
  std::vector<G> start;  ///< initial guess
  std::vector<PoseEdge<G>> edges;

  /// Computes the initial guess from the first pose and the odometry edges k → k + 1. Throws Error if one is missing.
  void initialise_by_odometry() {
    std::vector<const PoseEdge<G>*> next(start.size(), nullptr);
    for (const PoseEdge<G>& e : edges)
      if (e.to == e.from + 1 && !next[std::size_t(e.from)]) next[std::size_t(e.from)] = &e;
    for (std::size_t k = 0; k + 1 < start.size(); ++k) {
      if (!next[k]) throw Error("the pose graph has no odometry edge from pose " + std::to_string(k) + " to the next");
      start[k + 1] = start[k] * next[k]->z;
    }
  }
};

/// Reads a g2o file with VERTEX_SE3:QUAT and EDGE_SE3:QUAT, or VERTEX_SE2 and EDGE_SE2. Poses must be numbered from 0
/// without gaps. Information matrices refer to the tangent space, as in GTSAM. Throws Error that names file and line.
template <LieGroup G>
PoseGraph<G> read_g2o(const std::string& file) {
  constexpr bool planar = G::dof == 3;
  std::ifstream in(file);
  if (!in) throw Error(file + ": cannot be read");
  PoseGraph<G> graph;
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    std::istringstream words(line);
    std::string tag;
    words >> tag;
    const auto pose = [&]() -> G {
      if constexpr (planar) {
        double x = 0, y = 0, angle = 0;
        words >> x >> y >> angle;
        return G(SO2(angle), Vector<2>(x, y));
      } else {
        Vector<3> t;
        Eigen::Quaterniond q;
        words >> t[0] >> t[1] >> t[2] >> q.x() >> q.y() >> q.z() >> q.w();
        return G(SO3(q.normalized()), t);
      }
    };
    if (tag == (planar ? "VERTEX_SE2" : "VERTEX_SE3:QUAT")) {
      int id = 0;
      words >> id;
      if (id != int(graph.start.size()))
        throw Error(file + ":" + std::to_string(number) + ": poses must be numbered 0, 1, 2, …");
      graph.start.push_back(pose());
    } else if (tag == (planar ? "EDGE_SE2" : "EDGE_SE3:QUAT")) {
      int from = 0, to = 0;
      words >> from >> to;
      const G z = pose();
      Eigen::MatrixXd information(G::dof, G::dof);
      for (int i = 0; i < G::dof; ++i)
        for (int j = i; j < G::dof; ++j) {
          words >> information(i, j);
          information(j, i) = information(i, j);
        }
      if (from < 0 || to < 0 || std::max(from, to) >= int(graph.start.size()))
        throw Error(file + ":" + std::to_string(number) + ": an edge needs poses that are defined before it");
      graph.edges.push_back({from, to, z, Gaussian::information(information)});
    } else if (!tag.empty()) {
      throw Error(file + ":" + std::to_string(number) + ": " + tag + " is not supported");
    }
    if (!words) throw Error(file + ":" + std::to_string(number) + ": too few numbers");
  }
  graph.initialise_by_odometry();
  return graph;
}

/// Returns a pose graph with noisy measurements of the true poses along these edges.
template <LieGroup G>
PoseGraph<G> simulated_measurements(const std::vector<G>& truth, const std::vector<std::pair<int, int>>& pairs,
                                    const typename G::Tangent& sigma) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  PoseGraph<G> graph{truth, {}};
  for (const auto& [from, to] : pairs) {
    typename G::Tangent noise = sigma;
    for (double& x : noise) x *= normal(random);
    graph.edges.push_back({from, to, truth[std::size_t(from)].inverse() * truth[std::size_t(to)] * G::Exp(noise),
                           Gaussian(Eigen::VectorXd(sigma))});
  }
  graph.initialise_by_odometry();
  return graph;
}

/// Returns a graph on a sphere with a radius of 50 m: `rings` turns of `rings` poses, each connected to the pose below.
inline PoseGraph<SE3> simulated_sphere(int rings) {
  std::vector<SE3> truth;
  std::vector<std::pair<int, int>> pairs;
  for (int k = 0; k < rings * rings; ++k) {
    const double azimuth = 2 * std::numbers::pi * k / rings;
    const double elevation = std::numbers::pi * (k / double(rings * rings) - 0.5) * 0.9;
    const SO3 R = SO3::Exp({0, 0, azimuth}) * SO3::Exp({0, -elevation, 0});
    truth.emplace_back(R, R.act(Vector<3>(50, 0, 0)));
    if (k > 0) pairs.emplace_back(k - 1, k);
    if (k >= rings) pairs.emplace_back(k - rings, k);
  }
  return simulated_measurements<SE3>(truth, pairs, Vector<6>(0.05, 0.05, 0.05, 0.01, 0.01, 0.01));
}

/// Returns a planar lawn-mower graph: lanes of 100 poses 1 m apart. Every tenth pose is connected to its neighbour in
/// the previous lane.
inline PoseGraph<SE2> simulated_plane(int poses) {
  constexpr int kLane = 100;
  std::vector<SE2> truth;
  std::vector<std::pair<int, int>> pairs;
  for (int k = 0; k < poses; ++k) {
    const int lane = k / kLane, along = k % kLane;
    const bool back = lane % 2 == 1;
    truth.emplace_back(SO2(back ? std::numbers::pi : 0.0), Vector<2>(back ? kLane - 1 - along : along, lane));
    if (k > 0) pairs.emplace_back(k - 1, k);
    if (lane > 0 && along % 10 == 0) pairs.emplace_back(2 * lane * kLane - 1 - k, k);
  }
  return simulated_measurements<SE2>(truth, pairs, Vector<3>(0.01, 0.01, 0.001));
}

}  // namespace tandem::bench
