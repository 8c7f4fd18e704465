#include <tandem/lie/operations.hpp>
#include <tandem/solvers/online/online_estimator.hpp>

/// What an OnlineEstimator tells of the newest keyframe.
namespace tandem {

bool OnlineEstimator::started() const { return keyframes() > 0; }
bool OnlineEstimator::has_target() const { return !std::holds_alternative<std::monostate>(window_); }
double OnlineEstimator::newest() const { return lag_.newest(); }
double OnlineEstimator::oldest() const { return lag_.oldest(); }
double OnlineEstimator::cost() const { return cost_; }

std::size_t OnlineEstimator::keyframes() const {
  if (chain_) return chain_->keyframes().size();
  return in_window([](const auto& w) { return w.size(); }, std::size_t(0));
}

EgoState OnlineEstimator::chaser() const {
  if (chain_) return chain_->state(chain_->keyframes().back());
  EgoState state;
  state.pose = in_window([](const auto& w) { return w.chaser(w.size() - 1); }, SE3());
  return state;
}

std::optional<TargetState> OnlineEstimator::target() const {
  return in_window([](const auto& w) { return std::optional(w.target(w.size() - 1)); }, std::optional<TargetState>());
}

std::optional<Vector<3>> OnlineEstimator::target_velocity() const {
  return in_window([](const auto& w) { return std::optional(w.velocity()); }, std::optional<Vector<3>>());
}

std::optional<TargetState> OnlineEstimator::predicted_target(double h) const {
  return in_window([&](const auto& w) { return std::optional(w.predicted(newest() + h)); },
                   std::optional<TargetState>());
}

SE3 OnlineEstimator::predicted_chaser(double h) const {
  if (chain_) {
    const EgoState now = chaser();
    return SE3(now.pose.rotation(), now.pose.translation() + h * now.velocity);
  }
  return in_window([&](const auto& w) { return w.predicted_chaser(newest() + h); }, SE3());
}

OnlineEstimator::Covariance OnlineEstimator::covariance() const {
  Covariance c;
  if (chain_) {
    const EgoKeyframe& k = chain_->keyframes().back();
    c.chaser = lag_.covariance(k.pose);
    c.velocity = lag_.covariance(k.velocity);
    if (k.bias) c.bias = lag_.covariance(*k.bias);
  }
  with_window([&](const auto& window) {
    const std::size_t k = window.size() - 1;
    const auto& chaser = window.chaser_variable(k);
    if (!chain_) c.chaser = lag_.covariance(chaser);
    std::visit(
        [&]<class X>(const X& x) {
          if constexpr (!requires { x.first; }) {
            c.joint = lag_.covariance(chaser, x);
            const Eigen::Index n = c.joint.rows() - c.chaser.rows();
            c.target = c.joint.bottomRightCorner(n, n);
          }
        },
        window.target_variable(k));
  });
  return c;
}

std::vector<Stamped<EgoState>> OnlineEstimator::window() const {
  std::vector<Stamped<EgoState>> states;
  if (chain_) {
    for (const EgoKeyframe& k : chain_->keyframes()) states.push_back({k.t, chain_->state(k)});
  } else {
    with_window([&](const auto& w) {
      for (std::size_t k = 0; k < w.size(); ++k) {
        states.push_back({w.keyframes()[k].t, {}});
        states.back().value.pose = w.chaser(k);
      }
    });
  }
  return states;
}

std::vector<std::pair<double, double>> OnlineEstimator::splits() const {
  return chain_ ? chain_->splits() : std::vector<std::pair<double, double>>();
}

}  // namespace tandem
