#include <tandem/problem/tracking/track_smoother.hpp>

namespace tandem::detail {

SmoothedTrack smooth(const std::vector<Keyframe>& keyframes, const std::vector<PositionFix>& fixes, double q) {
  using State = Matrix<2, 3>;  // rows: position, velocity
  const std::size_t n = keyframes.size();
  std::vector<State> predicted(n), mean(n);
  std::vector<Matrix<2, 2>> predicted_cov(n), cov(n);
  const auto transition = [&](std::size_t k) {
    const double dt = keyframes[k].t - keyframes[k - 1].t;
    return Matrix<2, 2>{{1, dt}, {0, 1}};
  };
  auto fix = fixes.begin();
  for (std::size_t k = 0; k < n; ++k) {
    if (k == 0) {
      predicted[k].setZero();
      predicted[k].row(0) = fixes.front().position;
      predicted_cov[k] = Vector<2>(1e8, 1e4).asDiagonal();
    } else {
      const double dt = keyframes[k].t - keyframes[k - 1].t;
      const Matrix<2, 2> F = transition(k);
      predicted[k] = F * mean[k - 1];
      predicted_cov[k] =
          F * cov[k - 1] * F.transpose() + q * Matrix<2, 2>{{dt * dt * dt / 3, dt * dt / 2}, {dt * dt / 2, dt}};
    }
    mean[k] = predicted[k];
    cov[k] = predicted_cov[k];
    for (; fix != fixes.end() && fix->keyframe == k; ++fix) {
      const Vector<2> gain = cov[k].col(0) / (cov[k](0, 0) + fix->variance);
      mean[k] += gain * (fix->position.transpose() - mean[k].row(0));
      cov[k] -= gain * cov[k].row(0).eval();
    }
  }
  for (std::size_t k = n - 1; k-- > 0;) {
    const Matrix<2, 2> gain = cov[k] * transition(k + 1).transpose() * predicted_cov[k + 1].inverse();
    mean[k] += gain * (mean[k + 1] - predicted[k + 1]);
    cov[k] += gain * (cov[k + 1] - predicted_cov[k + 1]) * gain.transpose();
  }
  SmoothedTrack track;
  for (const Matrix<2, 2>& P : cov) {
    track.variance.push_back(P(0, 0));
    track.velocity_variance.push_back(P(1, 1));
  }
  for (const State& x : mean) {
    track.position.push_back(x.row(0));
    track.velocity.push_back(x.row(1));
  }
  return track;
}

}  // namespace tandem::detail
