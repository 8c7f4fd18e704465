#include <tandem/lie/operations.hpp>
#include <tandem/solvers/online/online_window.hpp>

/// What an OnlineWindow tells of its keyframes.
namespace tandem::detail {

KeyframeType OnlineWindow::newest_type() const {
  return of_target([](const auto& w) { return w.keyframes().back().type; }, KeyframeType::gated);
}

std::size_t OnlineWindow::keyframes() const {
  if (chain_) return chain_->keyframes().size();
  return of_target([](const auto& w) { return w.size(); }, std::size_t(0));
}

EgoState OnlineWindow::chaser() const {
  if (chain_) return chain_->state(chain_->keyframes().back());
  EgoState state;
  state.pose = of_target([](const auto& w) { return w.chaser(w.size() - 1); }, SE3());
  return state;
}

std::optional<TargetState> OnlineWindow::target() const {
  return of_target([](const auto& w) { return std::optional(w.target(w.size() - 1)); }, std::optional<TargetState>());
}

std::optional<Vector<3>> OnlineWindow::target_velocity() const {
  return of_target([](const auto& w) { return std::optional(w.velocity()); }, std::optional<Vector<3>>());
}

std::optional<TargetState> OnlineWindow::predicted_target(double h) const {
  return of_target([&](const auto& w) { return std::optional(w.predicted(newest() + h)); },
                   std::optional<TargetState>());
}

SE3 OnlineWindow::predicted_chaser(double h) const {
  if (chain_) {
    const EgoState now = chaser();
    return SE3(now.pose.rotation(), now.pose.translation() + h * now.velocity);
  }
  return of_target([&](const auto& w) { return w.predicted_chaser(newest() + h); }, SE3());
}

OnlineEstimator::Covariance OnlineWindow::covariance() const {
  OnlineEstimator::Covariance c;
  if (chain_) {
    const EgoKeyframe& k = chain_->keyframes().back();
    c.chaser = lag_.covariance(k.pose);
    c.velocity = lag_.covariance(k.velocity);
    if (k.bias) c.bias = lag_.covariance(*k.bias);
  }
  with_target([&](const auto& window) {
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

std::vector<Stamped<EgoState>> OnlineWindow::states() const {
  std::vector<Stamped<EgoState>> states;
  if (chain_) {
    for (const EgoKeyframe& k : chain_->keyframes()) states.push_back({k.t, chain_->state(k)});
  } else {
    with_target([&](const auto& w) {
      for (std::size_t k = 0; k < w.size(); ++k) {
        states.push_back({w.keyframes()[k].t, {}});
        states.back().value.pose = w.chaser(k);
      }
    });
  }
  return states;
}

std::vector<std::pair<double, double>> OnlineWindow::splits() const {
  return chain_ ? chain_->splits() : std::vector<std::pair<double, double>>();
}

}  // namespace tandem::detail
