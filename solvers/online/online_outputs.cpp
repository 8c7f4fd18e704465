#include <algorithm>
#include <array>

#include <tandem/lie/error.hpp>
#include <tandem/lie/operations.hpp>
#include <tandem/solvers/online/online_window.hpp>
#include <tandem/solvers/relative_covariance.hpp>

// The outputs of an OnlineWindow.
namespace tandem::detail {

KeyframeType OnlineWindow::newest_type() const {
  return of_target([](const auto& w) { return w.keyframes().back().type; }, KeyframeType::none);
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

/// Returns the transformation from the dead-reckoning frame to the world, from the chaser's newest pose in both.
SE3 OnlineWindow::world_from_dead_reckoning() const {
  return of_target([](const auto& w) { return w.chaser(w.size() - 1) * w.dead_reckoned(w.size() - 1).inverse(); },
                   SE3());
}

/// Returns the target predicted by the hypotheses. The orientation is that of the window at a measured pose, or if the
/// hypotheses have no course.
TargetState OnlineWindow::target_from_hypotheses(double h) const {
  const TargetMoments m = hypotheses_->at(newest() + h);
  const SE3 to_world = world_from_dead_reckoning();
  TargetState state(to_world.act(m.position));
  const auto held = window_target(0);
  const bool measured = h == 0 && newest_type() == KeyframeType::pose;
  if (m.heading && !measured)
    state.rotation = to_world.rotation() * SO3::Exp({0, 0, *m.heading});
  else if (held)
    state.rotation = held->rotation;
  return state;
}

std::optional<MotionHypotheses::Checkpoint> OnlineWindow::hypotheses() const {
  return hypotheses_ && hypotheses_->started() ? std::optional(hypotheses_->checkpoint()) : std::nullopt;
}

void OnlineWindow::restore(const MotionHypotheses::Checkpoint& checkpoint) {
  if (hypotheses_ && started() && checkpoint.t <= newest() + kSameInstant) hypotheses_->restore(checkpoint);
}

std::optional<TargetState> OnlineWindow::target() const {
  return uses_hypotheses() ? target_from_hypotheses(0) : window_target(0);
}

std::optional<Vector<3>> OnlineWindow::target_velocity() const {
  if (uses_hypotheses()) return world_from_dead_reckoning().rotation().act(hypotheses_->at(newest()).velocity);
  return of_target([](const auto& w) { return std::optional(w.velocity()); }, std::optional<Vector<3>>());
}

std::optional<TargetState> OnlineWindow::predicted_target(double h) const {
  if (uses_hypotheses()) return target_from_hypotheses(h);
  if (const auto ahead = forecast(h)) return ahead->state;
  return window_target(h);
}

/// Returns the target without hypotheses, h seconds after the newest keyframe with its last twist.
std::optional<TargetState> OnlineWindow::window_target(double h) const {
  return of_target(
      [&](const auto& w) { return std::optional(h == 0 ? w.target(w.size() - 1) : w.predicted(newest() + h)); },
      std::optional<TargetState>());
}

/// Returns the covariance of the target's newest position along the chaser's axes, from the window. Empty after a
/// failed update.
std::optional<Matrix<3, 3>> OnlineWindow::relative_covariance() const try {
  std::optional<Matrix<3, 3>> covariance;
  with_target([&]<LieGroup G>(const TargetWindow<G>& window) {
    const auto& chaser = window.chaser_variable(window.size() - 1);
    std::visit(
        [&]<class X>(const X& x) {
          if constexpr (!requires { x.first; }) {
            const Problem& problem = lag_.problem();
            covariance.emplace(Matrix<3, 3>::Zero());
            covariance->topLeftCorner<G::point_dim, G::point_dim>() =
                relative_position_covariance(problem.value(chaser), problem.value(x), lag_.covariance(chaser, x));
          }
        },
        window.target_variable(window.size() - 1));
  });
  return covariance;
} catch (const NumericalError&) {
  return {};
}

/// Predicts the target with the motion model of the window. Empty for h ≤ 0, at the first keyframe and after a failed
/// update.
std::optional<OnlineWindow::Forecast> OnlineWindow::forecast(double h) const try {
  std::optional<Forecast> ahead;
  if (!(h > 0)) return ahead;
  with_target([&]<LieGroup G>(const TargetWindow<G>& window) {
    const auto joint = [&](const auto& ids, const auto& dofs) { return lag_.covariance(ids, dofs); };
    const auto there = window.forecast(h, joint);
    if (!there) return;
    const G& seen_from = lag_.problem().value(window.chaser_variable(window.size() - 1));
    const Rn<G::point_dim> point(in_group<G>(there->state.position));
    ahead.emplace(Forecast{there->state, Matrix<3, 3>::Zero()});
    ahead->covariance.topLeftCorner<G::point_dim, G::point_dim>() =
        relative_position_covariance(seen_from, point, there->covariance);
  });
  return ahead;
} catch (const NumericalError&) {
  return {};
}

std::optional<RelativeTarget> OnlineWindow::relative_target(double h) const {
  const SE3 seen_from = chaser().pose;
  if (uses_hypotheses()) {
    const TargetMoments m = hypotheses_->at(newest() + h);
    const SE3 to_body = seen_from.inverse() * world_from_dead_reckoning();
    const Matrix<3, 3> R = to_body.rotation().matrix();
    return RelativeTarget{to_body.act(m.position), R * m.covariance * R.transpose()};
  }
  if (const auto ahead = forecast(h))
    return RelativeTarget{seen_from.inverse().act(ahead->state.position), ahead->covariance};
  const auto there = window_target(h);
  if (!there) return {};
  RelativeTarget relative{seen_from.inverse().act(there->position)};
  if (h == 0) relative.covariance = relative_covariance();
  return relative;
}

SE3 OnlineWindow::predicted_chaser(double h) const {
  if (chain_) {
    const EgoState now = chaser();
    return SE3(now.pose.rotation(), now.pose.translation() + h * now.velocity);
  }
  return of_target([&](const auto& w) { return w.predicted_chaser(newest() + h); }, SE3());
}

const EgoKeyframe& OnlineWindow::own_keyframe(double t) const {
  const std::deque<EgoKeyframe>& all = chain_->keyframes();
  const auto after = std::find_if(all.begin(), all.end(), [&](const EgoKeyframe& k) { return k.t > t; });
  return after == all.begin() ? all.front() : *(after - 1);
}

OnlineEstimator::Covariance OnlineWindow::own_covariance(const EgoKeyframe& k) const {
  OnlineEstimator::Covariance c;
  c.chaser = lag_.covariance(k.pose);
  c.velocity = lag_.covariance(k.velocity);
  if (k.bias) c.bias = lag_.covariance(*k.bias);
  return c;
}

OnlineEstimator::Covariance OnlineWindow::covariance() const {
  OnlineEstimator::Covariance c;
  if (chain_) c = own_covariance(chain_->keyframes().back());
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

OnlineEstimator::Instant OnlineWindow::at(double t, const std::vector<Stamped<SE3>>& odometry) const try {
  return at(t, odometry, [this](const Eigen::MatrixXd& J, const auto& ids, const auto& dofs) {
    return Eigen::MatrixXd(J * lag_.covariance(ids, dofs) * J.transpose());
  });
} catch (const NumericalError&) {  // no covariance after a failed update
  return at(t, odometry, {});
}

OnlineEstimator::Instant OnlineWindow::at(double t, const std::vector<Stamped<SE3>>& odometry,
                                          const PropagateCovariance& propagate) const {
  OnlineEstimator::Instant instant;
  const auto in_reach = [&](const auto& keyframes) {
    return keyframes.size() >= 2 && t >= keyframes.front().t && t <= keyframes.back().t;
  };
  if (chain_ && in_reach(chain_->keyframes())) {
    const std::size_t k = interval_at(chain_->keyframes(), t);
    const std::array around{chain_->keyframes()[k], chain_->keyframes()[k + 1]};
    instant.chaser = EgoTrajectory(lag_.problem(), around, chain_->imu(), ego_->earth, options_.ego).at(t, propagate);
  }
  with_target([&](const auto& window) {
    if (!in_reach(window.keyframes())) return;
    instant.target = window.target_at(t, propagate);
    if (!chain_) instant.chaser = window.chaser_at(t, odometry, propagate);
  });
  return instant;
}

std::vector<OnlineEstimator::SensorError> OnlineWindow::sensor_errors() const {
  std::vector<OnlineEstimator::SensorError> errors;
  const auto add = [&](const std::string& name, const auto& x, const Eigen::VectorXd& prior_sigma) {
    errors.push_back({name, lag_.problem().value(x).Log(), prior_sigma, {}});
    try {
      errors.back().sigma = lag_.covariance(x).diagonal().cwiseMax(0).cwiseSqrt();
    } catch (const NumericalError&) {  // added since the last update, or that has no covariance
    }
  };
  if (chain_) chain_->each_systematic_error(add);
  with_target([&](const auto& window) { window.each_systematic_error(add); });
  return errors;
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
