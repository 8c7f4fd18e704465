#include <tandem/studies/navigation/ego_covariance.hpp>

namespace tandem {

EgoCovariance ego_covariance(const Marginals& marginals, const EgoKeyframe& keyframe) {
  EgoCovariance covariance{marginals.covariance(keyframe.pose), marginals.covariance(keyframe.velocity)};
  if (keyframe.bias) covariance.bias = marginals.covariance(*keyframe.bias);
  return covariance;
}

PropagateCovariance propagate_by(const Marginals* marginals) {
  if (!marginals) return {};
  return [marginals](const Eigen::MatrixXd& J, const std::vector<int>& ids, const std::vector<int>& dofs) {
    return marginals->propagated(J, ids, dofs);
  };
}

EgoCovariance ego_covariance(const OnlineEstimator& estimator) {
  const OnlineEstimator::Covariance newest = estimator.covariance();
  EgoCovariance covariance{newest.chaser, newest.velocity};
  if (newest.bias.size() > 0) covariance.bias = newest.bias;
  return covariance;
}

}  // namespace tandem
