#include <cmath>

#include <tandem/problem/tracking/planar.hpp>
#include <tandem/residuals/steady_course.hpp>
#include <tandem/solvers/heading_search/range_observability.hpp>
#include <tandem/solvers/relative_covariance.hpp>
#include <tandem/studies/estimation/uncertainty.hpp>
#include <tandem/studies/support/mahalanobis.hpp>
#include <tandem/studies/support/statistics.hpp>

namespace tandem {
namespace {

/// Returns the joint covariance of several variables, in the order of the arguments.
template <LieGroup... Xs>
Eigen::MatrixXd joint(const Marginals& marginals, const Variable<Xs>&... x) {
  constexpr int n = (Xs::dof + ...);
  Eigen::MatrixXd S(n, n);
  Eigen::Index row = 0;
  const auto fill_rows = [&]<LieGroup A>(const Variable<A>& a) {
    Eigen::Index column = 0;
    ((S.block<A::dof, Xs::dof>(row, column) = marginals.cross_covariance(a, x), column += Xs::dof), ...);
    row += A::dof;
  };
  (fill_rows(x), ...);
  return S;
}

/// Returns the matrix that embeds the tangent space of G in the tangent space of SE(3) (6 rows) or R³ (3 rows).
template <LieGroup G>
Eigen::MatrixXd embedding() {
  if constexpr (std::same_as<G, SE2>) {
    Eigen::MatrixXd E = Eigen::MatrixXd::Zero(6, 3);
    E(0, 0) = E(1, 1) = E(5, 2) = 1;
    return E;
  } else if constexpr (std::same_as<G, R2>) {
    return Eigen::MatrixXd::Identity(3, 2);
  } else {
    return Eigen::MatrixXd::Identity(G::dof, G::dof);
  }
}

Eigen::MatrixXd block_diagonal(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  Eigen::MatrixXd D = Eigen::MatrixXd::Zero(a.rows() + b.rows(), a.cols() + b.cols());
  D.topLeftCorner(a.rows(), a.cols()) = a;
  D.bottomRightCorner(b.rows(), b.cols()) = b;
  return D;
}

/// Computes the covariance of [δC; δT], chaser and target, in three dimensions.
class JointCovariance {
 public:
  JointCovariance(const Marginals& marginals, const Problem& problem) : marginals_(marginals), problem_(problem) {}

  template <LieGroup C, LieGroup T>
  Eigen::MatrixXd operator()(const Variable<C>& c, const Variable<T>& t) const {
    return detail::propagated(block_diagonal(embedding<C>(), embedding<T>()), joint(marginals_, c, t));
  }
  /// T = first Exp(t [speed 0 …]). This Exp is a pure translation, so δT = Ad(Exp(…)⁻¹) δfirst + t e₁ δspeed.
  template <LieGroup C, LieGroup G>
  Eigen::MatrixXd operator()(const Variable<C>& c, const CourseVariable<G>& course) const {
    const G way = steady_course_motion<G>(course.t, problem_.value(course.speed).vector()[0]);
    Matrix<G::dof, G::dof + 1> J;
    J << way.inverse().Ad(), course.t * G::Tangent::Unit(0);
    return detail::propagated(block_diagonal(embedding<C>(), embedding<G>() * J),
                              joint(marginals_, c, course.first, course.speed));
  }

 private:
  const Marginals& marginals_;
  const Problem& problem_;
};

KeyframeUncertainty at_keyframe(const SE3& chaser, const TargetState& target, const Eigen::MatrixXd& joint) {
  KeyframeUncertainty u;
  u.chaser = joint.topLeftCorner<6, 6>();
  const Eigen::Index n = joint.rows() - 6;
  u.target = joint.bottomRightCorner(n, n);
  u.cross = joint.topRightCorner(6, n);
  if (!target.rotation) {
    u.relative_position = relative_position_covariance<SE3, R3>(chaser, R3(target.position), joint);
    return u;
  }
  const SE3 pose(*target.rotation, target.position);
  u.relative_position = relative_position_covariance<SE3, SE3>(chaser, pose, joint);
  u.relative_rotation = relative_pose_covariance<SE3>(chaser, pose, joint).bottomRightCorner<3, 3>();
  return u;
}

/// Replaces variances of positions by infinity if only the direction of the line of sight is known (in the world).
void add_unknown_range(const SE3& chaser, const TargetState& target, const Vector<3>& sight, KeyframeUncertainty& u) {
  tandem::add_unknown_range(target.rotation ? Vector<3>(target.rotation->inverse().act(sight)) : sight, u.target);
  Eigen::MatrixXd relative = u.relative_position;
  tandem::add_unknown_range(chaser.rotation().inverse().act(sight), relative);
  u.relative_position = relative;
  u.cross.resize(0, 0);
}

}  // namespace

void add_unknown_range(const Vector<3>& sight, Eigen::Ref<Eigen::MatrixXd> covariance) {
  constexpr double kRounding = 1e-9;
  for (Eigen::Index i = 0; i < 3; ++i) {
    if (std::abs(sight[i]) <= kRounding * sight.norm()) continue;
    covariance.row(i).setZero();
    covariance.col(i).setZero();
    covariance(i, i) = HUGE_VAL;
  }
}

bool HeldOut::row_inside(Eigen::Index i) const {
  return std::abs(r[i]) <= normal_quantile(0.975) * std::sqrt(covariance(i, i));
}

int HeldOut::rows_inside() const {
  int inside = 0;
  for (Eigen::Index i = 0; i < r.size(); ++i) inside += row_inside(i);
  return inside;
}

double HeldOut::squared_distance() const { return tandem::squared_distance(r, covariance); }

bool HeldOut::inside() const { return squared_distance() <= chi_squared_quantile(double(r.size()), 0.95); }

std::vector<Marginals::Pair> pairs_at_keyframes(const TrackingProblem& tracking) {
  std::vector<Marginals::Pair> pairs;
  const Problem& problem = tracking.problem;
  const auto add = [&](const auto& chaser, const auto& target) {
    if constexpr (requires { target.speed; }) {
      pairs.emplace_back(problem.id(chaser), problem.id(target.first));
      pairs.emplace_back(problem.id(chaser), problem.id(target.speed));
    } else {
      pairs.emplace_back(problem.id(chaser), problem.id(target));
    }
  };
  for (std::size_t k = 0; k < tracking.keyframes.size(); ++k) std::visit(add, tracking.chaser[k], tracking.target[k]);
  for (const PlacedMeasurement& m : tracking.measurements) {
    if (!m.innovation) continue;
    const std::vector<int> read = m.innovation(problem).variable_ids;
    for (auto b = read.begin(); b != read.end(); ++b)
      for (auto a = read.begin(); a != b; ++a) pairs.emplace_back(*a, *b);
  }
  return pairs;
}

Uncertainty uncertainty(TrackingProblem& tracking, const TrackingData& data, const Marginals& marginals,
                        const Stop& stop) {
  Uncertainty result;
  result.constants = systematic_error_estimates_by_evidence(tracking.problem, tracking.constants, marginals, stop);
  const bool has_range = range_is_observable(tracking, marginals);
  for (std::size_t k = 0; k < tracking.keyframes.size(); ++k) {
    stop.check("covariances");
    const Eigen::MatrixXd both =
        std::visit(JointCovariance(marginals, tracking.problem), tracking.chaser[k], tracking.target[k]);
    const SE3 chaser = tracking.chaser_pose(k);
    const TargetState target = tracking.target_state(k);
    result.keyframes.push_back(at_keyframe(chaser, target, both));
    if (has_range) continue;
    const TargetSensor& sensor = data.sensors[tracking.assumed_range->sensor];
    add_unknown_range(chaser, target, target.position - chaser.act(sensor.mount.translation()),
                      result.keyframes.back());
  }
  for (const PlacedMeasurement& m : tracking.measurements) {
    if (!m.innovation) continue;
    const auto [r, J, variables, dofs] = m.innovation(tracking.problem);
    Eigen::MatrixXd S = marginals.propagated(J, variables, dofs);
    S.diagonal() += data.sensors[m.sensor].sigma.head(r.size()).cwiseAbs2();
    result.held_out.push_back({m.sensor, m.index, r, S});
  }
  return result;
}

}  // namespace tandem
