#include <Eigen/Cholesky>

#include <tandem/lie/operations.hpp>
#include <tandem/residuals/range_bearing.hpp>
#include <tandem/residuals/relative_pose.hpp>
#include <tandem/residuals/usbl_position.hpp>
#include <tandem/solvers/marginals.hpp>
#include <tandem/solvers/relative_covariance.hpp>
#include <tandem/studies/estimation/uncertainty.hpp>
#include <tandem/studies/study/trial_consistency.hpp>
#include <tandem/studies/support/squared_distance.hpp>

namespace tandem {
namespace {

struct ConsistencySums {
  Moments chaser, target, relative_pose, relative_position, inside, usbl, optical;
};

/// The squared distance, of a covariance that no hard constraint makes singular: along what is held exactly there is
/// no σ to compare an error with.
std::optional<double> nees_of(const Eigen::VectorXd& error, const Eigen::MatrixXd& S) {
  const Eigen::VectorXd sigma = S.diagonal().cwiseMax(0).cwiseSqrt();
  if (!(sigma.minCoeff() > 0)) return {};
  const Eigen::VectorXd by_sigma = sigma.cwiseInverse();
  const Eigen::LDLT<Eigen::MatrixXd> correlation(by_sigma.asDiagonal() * S * by_sigma.asDiagonal());
  if (!(correlation.vectorD().minCoeff() > 1e-9)) return {};
  return squared_distance(error, S);
}

/// Of a residual at the estimate, by the prediction of all others.
double nis(const Eigen::VectorXd& r, const Eigen::MatrixXd& J, const Eigen::VectorXd& sigma,
           const Eigen::MatrixXd& joint) {
  const Eigen::MatrixXd by_states = J * joint;
  Eigen::MatrixXd S = -by_states * J.transpose();
  S.diagonal() += sigma.head(r.size()).cwiseAbs2();
  return squared_distance(r, S);
}

template <class R, class T>
double nis(const R& residual, const Eigen::VectorXd& sigma, const SE3& c, const T& t, const Eigen::MatrixXd& joint) {
  Vector<R::dim> r;
  Matrix<R::dim, 6> Jc;
  Matrix<R::dim, T::dof> Jt;
  residual(c, t, r, &Jc, &Jt);
  Eigen::MatrixXd J(R::dim, 6 + T::dof);
  J << Jc, Jt;
  return nis(r, J, sigma, joint);
}

template <class T>
void add_measurement(const TargetSensor& sensor, const Measurement& m, const SE3& c, const T& t,
                     const Eigen::MatrixXd& joint, ConsistencySums& sums) {
  if (sensor.type == SensorType::position) {
    sums.usbl.add(nis(UsblPosition<SE3, T>{m.position, sensor.mount}, sensor.sigma, c, t, joint));
  } else if (sensor.type == SensorType::range_bearing) {
    const RangeBearing<SE3, T> residual{m.range, Direction<3>(m.azimuth, m.elevation), sensor.mount};
    sums.usbl.add(nis(residual, sensor.sigma, c, t, joint));
  } else if (sensor.type == SensorType::pose) {
    if constexpr (std::same_as<T, SE3>)
      sums.optical.add(
          nis(RelativePose<SE3>{SE3(m.rotation, m.position), sensor.mount, sensor.marker}, sensor.sigma, c, t, joint));
  }
}

/// Truth and estimate at one keyframe, T a pose or a point.
template <class T>
void add_keyframe(const SE3& c, const T& t, const Eigen::MatrixXd& joint, const SE3& true_c, const SE3& true_t,
                  ConsistencySums& sums) {
  sums.chaser.add(nees_of(minus(true_c, c), joint.topLeftCorner<6, 6>()));
  const Matrix<3, 3> S = relative_position_covariance<SE3, T>(c, t, joint);
  const Vector<3> origin = Vector<3>::Zero();
  const Vector<3> e = c.inverse().act(t.act(origin)) - true_c.inverse().act(true_t.translation());
  sums.relative_position.add(nees_of(e, S));
  for (int i = 0; i < 3; ++i) sums.inside.add(std::abs(e[i]) <= 3 * std::sqrt(S(i, i)));
  if constexpr (std::same_as<T, SE3>) {
    sums.target.add(nees_of(minus(true_t, t), joint.bottomRightCorner<6, 6>()));
    sums.relative_pose.add(
        nees_of(minus(true_c.inverse() * true_t, c.inverse() * t), relative_pose_covariance<SE3>(c, t, joint)));
  }
}

bool whole_weight(const Problem& problem, const PlacedMeasurement& m) {
  return m.block && !m.orientation && !m.position && problem.weight(*m.block) > 0.999;
}

}  // namespace

void add_consistency(TrackingProblem& tracking, const Scenario& scenario, TrialResult& result) {
  const Problem& problem = tracking.problem;
  const Marginals marginals(tracking.problem, pairs_at_keyframes(tracking));
  std::vector<std::vector<const PlacedMeasurement*>> measured(tracking.keyframes.size());
  for (const PlacedMeasurement& m : tracking.measurements) measured[m.keyframe].push_back(&m);

  ConsistencySums sums;
  for (std::size_t k = 0; k < tracking.keyframes.size(); ++k) {
    const auto* const chaser = std::get_if<Variable<SE3>>(&tracking.chaser[k]);
    if (!chaser) return;
    const SE3 c = problem.value(*chaser);
    const auto true_c = pose_at(scenario.truth_chaser, tracking.keyframes[k].t);
    const auto true_t = pose_at(scenario.truth_target, tracking.keyframes[k].t);
    const auto add = [&](const auto& target) {
      const auto t = problem.value(target);
      const Eigen::MatrixXd joint = marginals.joint(*chaser, target);
      if (true_c && true_t) add_keyframe(c, t, joint, *true_c, *true_t, sums);
      for (const PlacedMeasurement* m : measured[k]) {
        const TargetSensor& sensor = scenario.data.sensors[m->sensor];
        if (whole_weight(problem, *m)) add_measurement(sensor, sensor.measurements[m->index], c, t, joint, sums);
      }
    };
    if (const auto* const pose = std::get_if<Variable<SE3>>(&tracking.target[k]))
      add(*pose);
    else if (const auto* const point = std::get_if<Variable<R3>>(&tracking.target[k]))
      add(*point);
    else
      return;
  }
  const auto set = [&](std::string_view metric, const Moments& of) {
    if (const auto spread = of.spread()) result.set(metric, spread->mean);
  };
  set("nees_chaser", sums.chaser);
  set("nees_target", sums.target);
  set("nees_relative_pose", sums.relative_pose);
  set("nees_relative_position", sums.relative_position);
  set("inside_three_sigma", sums.inside);
  set("nis_usbl", sums.usbl);
  set("nis_optical", sums.optical);
}

}  // namespace tandem
