// Solves a pose graph in space or in the plane from a g2o file. Without a file it generates one first.
//
//   06_pose_graph [FILE.g2o]
#include <cmath>
#include <cstdio>
#include <fstream>
#include <map>
#include <numbers>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include <tandem/lie/error.hpp>
#include <tandem/lie/se2.hpp>
#include <tandem/lie/se3.hpp>
#include <tandem/problem/nlp_evaluator.hpp>
#include <tandem/residuals/relative_pose.hpp>
#include <tandem/solvers/chordal_start.hpp>
#include <tandem/solvers/gauss_newton.hpp>

using namespace tandem;

/// Reads a pose: x y z qx qy qz qw, or x y yaw.
void read(std::istream& in, SE3& pose) {
  Vector<3> t;
  Eigen::Quaterniond q;
  in >> t.x() >> t.y() >> t.z() >> q.x() >> q.y() >> q.z() >> q.w();
  if (!in || std::abs(q.norm() - 1) > 1e-2) return in.setstate(std::ios::failbit);
  pose = SE3(SO3(q.normalized()), t);
}
void read(std::istream& in, SE2& pose) {
  double x = 0, y = 0, yaw = 0;
  in >> x >> y >> yaw;
  pose = SE2(SO2(yaw), Vector<2>(x, y));
}

/// Solves the graph of a file with the first pose fixed. Starts from the poses of the file or from the chordal start,
/// whichever has the lower cost. The chordal start may avoid a local minimum. Information matrices refer to tangent
/// vectors [m, rad].
template <LieGroup G>
Summary solve_graph(const std::string& file) {
  const std::string vertex = G::dof == 3 ? "VERTEX_SE2" : "VERTEX_SE3:QUAT";
  const std::string edge = G::dof == 3 ? "EDGE_SE2" : "EDGE_SE3:QUAT";
  Problem problem;
  std::map<int, std::size_t> index;  // index of the variable, by the id of the vertex
  std::vector<Variable<G>> poses;
  std::vector<PoseEdge<G>> edges;
  std::ifstream in(file);
  std::string line, tag;
  for (int number = 1; std::getline(in, line); ++number) {
    const std::string where = file + ":" + std::to_string(number) + ": ";
    std::istringstream words(line);
    if (!(words >> tag) || tag == "FIX" || tag[0] == '#') continue;
    G pose;
    int from = 0, to = 0;
    if (tag == vertex) {
      words >> from;
      read(words, pose);
      if (!words) throw Error(where + "a vertex needs an id, a position and an orientation (unit quaternion)");
      if (!index.emplace(from, poses.size()).second)
        throw Error(where + "pose " + std::to_string(from) + " is defined twice");
      poses.push_back(problem.add(pose, "pose " + std::to_string(from)));
    } else if (tag == edge) {
      words >> from >> to;
      read(words, pose);
      Eigen::MatrixXd information(G::dof, G::dof);  // the file has the upper triangle by rows
      for (int i = 0; i < G::dof; ++i)
        for (int j = i; j < G::dof; ++j) {
          words >> information(i, j);
          information(j, i) = information(i, j);
        }
      if (!words) throw Error(where + "an edge needs two ids, a pose and an information matrix");
      if (!index.contains(from) || !index.contains(to))
        throw Error(where + "the edge refers to a pose that is not defined above");
      edges.push_back({int(index[from]), int(index[to]), pose, Gaussian::information(information)});
      problem.minimize(RelativePose<G>{pose}, edges.back().noise, {poses[index[from]], poses[index[to]]});
    } else {
      throw Error(where + "unknown tag " + tag + "; expected " + vertex + " or " + edge);
    }
  }
  problem.fix(poses[0]);
  Problem chordal = problem.copy();
  const std::vector<G> start = chordal_start<G>(int(poses.size()), edges, problem.value(poses[0]));
  for (std::size_t i = 0; i < start.size(); ++i) chordal.set_value(chordal.counterpart(poses[i]), start[i]);
  const bool better = NlpEvaluator(chordal).cost() < NlpEvaluator(problem).cost();
  std::printf("start: %s\n", better ? "chordal relaxation of the rotations" : "poses of the file");
  return solve(better ? chordal : problem, GaussNewtonOptions{});
}

/// Writes a spiral on a sphere of radius 20 m. Each pose is measured from the previous pose and from the pose one round
/// below, with noise. The initial poses come from the odometry.
void write_globe(const std::string& file, int rounds, int poses_a_round) {
  const Vector<6> sigma(0.05, 0.05, 0.05, 0.01, 0.01, 0.01);  // m, rad
  const int poses = rounds * poses_a_round;
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  std::ofstream out(file);
  std::ostringstream edges;
  const auto write = [](std::ostream& to, const SE3& x) {
    to.precision(12);
    to << ' ' << x.translation().transpose() << ' ' << x.rotation().quaternion().coeffs().transpose();  // qx qy qz qw
  };
  std::vector<SE3> truth;
  SE3 odometry;
  for (int k = 0; k < poses; ++k) {
    const double azimuth = 2 * std::numbers::pi * k / poses_a_round, elevation = 2.8 * (double(k) / poses - 0.5);
    const SO3 R = SO3::Exp({0, 0, azimuth}) * SO3::Exp({0, -elevation, 0});
    truth.emplace_back(R, R.act(Vector<3>(20, 0, 0)));
    if (k == 0) odometry = truth[0];
    for (const int from : {k - poses_a_round, k - 1}) {
      if (from < 0) continue;
      Vector<6> noise = sigma;
      for (double& x : noise) x *= normal(random);
      const SE3 z = truth[std::size_t(from)].inverse() * truth[std::size_t(k)] * SE3::Exp(noise);
      edges << "EDGE_SE3:QUAT " << from << ' ' << k;
      write(edges, z);
      for (int i = 0; i < 6; ++i)
        for (int j = i; j < 6; ++j) edges << ' ' << (i == j ? 1 / (sigma[i] * sigma[i]) : 0.0);
      edges << '\n';
      if (from == k - 1) odometry = odometry * z;
    }
    out << "VERTEX_SE3:QUAT " << k;
    write(out, odometry);
    out << '\n';
  }
  out << edges.str();
  if (!out.flush()) throw Error(file + ": cannot write the file");
}

/// Returns true if the first vertex of the file is planar.
bool is_planar(const std::string& file) {
  std::ifstream in(file);
  if (!in) throw Error(file + ": cannot read the file");
  for (std::string tag, rest; in >> tag; std::getline(in, rest)) {
    if (tag == "VERTEX_SE2") return true;
    if (tag == "VERTEX_SE3:QUAT") return false;
  }
  throw Error(file + ": the file has neither VERTEX_SE2 nor VERTEX_SE3:QUAT");
}

int main(int count, char** arguments) try {
  const bool made = count < 2;
  const std::string file = made ? "globe.g2o" : arguments[1];
  if (made) write_globe(file, 20, 25);
  const Summary summary = is_planar(file) ? solve_graph<SE2>(file) : solve_graph<SE3>(file);
  std::printf("%s: %s after %d iterations, cost %.6g (from %.6g), %.3f s\n%s\n", file.c_str(),
              std::string(name(summary.status)).c_str(), summary.iterations, summary.cost, summary.initial_cost,
              summary.seconds, summary.message.c_str());
  // The expected cost is ½ for each redundant row: there are 974 edges and 499 free poses.
  const bool as_expected = !made || std::abs(summary.cost / (0.5 * 6 * (974 - 499)) - 1) < 0.1;
  return summary.converged() && as_expected ? 0 : 1;
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 2;
}
