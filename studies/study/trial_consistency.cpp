#include <map>

#include <Eigen/Cholesky>

#include <tandem/lie/operations.hpp>
#include <tandem/problem/tracking/ego_track.hpp>
#include <tandem/problem/tracking/planar.hpp>
#include <tandem/solvers/relative_covariance.hpp>
#include <tandem/studies/estimation/uncertainty.hpp>
#include <tandem/studies/study/trial_consistency.hpp>
#include <tandem/studies/study/trial_sensors.hpp>
#include <tandem/studies/support/mahalanobis.hpp>

namespace tandem {
namespace {

struct ConsistencySums {
  Moments chaser, target, relative_pose, relative_position, inside;
};

/// Returns eᵀ S⁻¹ e; nullopt if S is not positive definite. It has no value if a hard constraint
/// makes the covariance singular, or if a direction is unobservable.
std::optional<double> normalised_square(const Eigen::VectorXd& error, const Eigen::MatrixXd& S) {
  const Eigen::VectorXd sigma = S.diagonal().cwiseMax(0).cwiseSqrt();
  if (!(sigma.minCoeff() > 0 && sigma.allFinite())) return {};
  const Eigen::VectorXd by_sigma = sigma.cwiseInverse();
  const Eigen::LDLT<Eigen::MatrixXd> correlation(by_sigma.asDiagonal() * S * by_sigma.asDiagonal());
  if (!(correlation.vectorD().minCoeff() > 1e-9)) return {};
  return squared_distance(error, S);
}

/// Returns the leave-one-out NIS of a block. R: covariance of its noise. The NIS has no value if R − H P Hᵀ is not
/// positive definite: the block alone determines a direction of the states, or its loss reduces its weight.
std::optional<double> nis(const Problem& problem, const Marginals& marginals, const Block& block,
                          const Eigen::MatrixXd& R) {
  const Problem::Linearization at = problem.linearization(block);
  return normalised_square(at.residual, R - marginals.propagated(at.jacobian, at.variable_ids, at.dofs));
}

bool whole_weight(const Problem& problem, const Block& block) { return problem.weight(block) > 0.999; }

/// Adds one keyframe to the sums. G: group of the chaser's pose. T: G, or a point.
template <LieGroup G, LieGroup T>
void add_keyframe(const G& c, const T& t, const Eigen::MatrixXd& joint, const G& true_c, const G& true_t,
                  ConsistencySums& sums) {
  sums.chaser.add(normalised_square(minus(true_c, c), joint.topLeftCorner<G::dof, G::dof>()));
  const Matrix<G::point_dim, G::point_dim> S = relative_position_covariance<G, T>(c, t, joint);
  const Vector<G::point_dim> origin = Vector<G::point_dim>::Zero();
  const Vector<G::point_dim> e = c.inverse().act(t.act(origin)) - true_c.inverse().act(true_t.translation());
  sums.relative_position.add(normalised_square(e, S));
  for (int i = 0; i < G::point_dim; ++i) sums.inside.add(std::abs(e[i]) <= 3 * std::sqrt(S(i, i)));
  if constexpr (std::same_as<T, G>) {
    sums.target.add(normalised_square(minus(true_t, t), joint.bottomRightCorner<G::dof, G::dof>()));
    sums.relative_pose.add(
        normalised_square(minus(true_c.inverse() * true_t, c.inverse() * t), relative_pose_covariance<G>(c, t, joint)));
  }
}

}  // namespace

void add_own_nis(const Problem& problem, const Marginals& marginals, const std::vector<EgoSensor>& sensors,
                 const std::vector<PlacedEgoMeasurement>& placed, TrialResult& result) {
  std::map<std::string, Moments> means;
  for (const PlacedEgoMeasurement& m : placed)
    if (m.block && whole_weight(problem, *m.block))
      means[nis_metric(sensors[m.sensor].name)].add(
          nis(problem, marginals, *m.block, problem.noise(*m.block).covariance_matrix()));
  for (const auto& [metric, mean] : means) result.set_mean(metric, mean);
}

void add_consistency(TrackingProblem& tracking, const Scenario& scenario, TrialResult& result) {
  const Problem& problem = tracking.problem;
  const Marginals marginals(tracking.problem, pairs_at_keyframes(tracking));
  ConsistencySums sums;
  for (std::size_t k = 0; k < tracking.keyframes.size(); ++k) {
    const auto true_c = pose_at(scenario.truth_chaser, tracking.keyframes[k].t);
    const auto true_t = pose_at(scenario.truth_target, tracking.keyframes[k].t);
    if (!true_c || !true_t) continue;
    const auto add = [&]<LieGroup G>(const Variable<G>& chaser, const auto& target) {
      if constexpr (!requires { target.speed; }) {
        using T = std::remove_cvref_t<decltype(problem.value(target))>;
        if constexpr (T::point_dim == G::point_dim)
          add_keyframe<G, T>(problem.value(chaser), problem.value(target), marginals.joint(chaser, target),
                             in_group<G>(*true_c), in_group<G>(*true_t), sums);
      }
    };
    std::visit(add, tracking.chaser[k], tracking.target[k]);
  }
  std::map<std::string, Moments> sensor_nis;
  for (const PlacedMeasurement& m : tracking.measurements) {
    if (!m.block || m.orientation || m.position || !whole_weight(problem, *m.block)) continue;
    const TargetSensor& sensor = scenario.data.sensors[m.sensor];
    const Eigen::MatrixXd R = sensor.sigma.cwiseAbs2().asDiagonal();
    sensor_nis[nis_metric(sensor.name)].add(nis(problem, marginals, *m.block, R));
  }
  result.set_mean("nees_chaser", sums.chaser);
  result.set_mean("nees_target", sums.target);
  result.set_mean("nees_relative_pose", sums.relative_pose);
  result.set_mean("nees_relative_position", sums.relative_position);
  result.set_mean("inside_three_sigma", sums.inside);
  for (const auto& [metric, mean] : sensor_nis) result.set_mean(metric, mean);
  if (scenario.data.ego)
    add_own_nis(problem, marginals, scenario.data.ego->data.sensors, tracking.ego_measurements, result);
}

}  // namespace tandem
