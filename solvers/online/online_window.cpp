#include <algorithm>
#include <utility>

#include <tandem/lie/error.hpp>
#include <tandem/lie/operations.hpp>
#include <tandem/solvers/gauss_newton.hpp>
#include <tandem/solvers/online/innovation_gate.hpp>
#include <tandem/solvers/online/online_window.hpp>
#include <tandem/solvers/online/target_fix.hpp>

namespace tandem::detail {
namespace {

constexpr int kSettlingIterations = 100;
constexpr double kSettled = 1e-7;  // relative decrease of the cost

}  // namespace

OnlineWindow::OnlineWindow(const TrackingData& settings, const NavigationData* ego, const OnlineOptions& options)
    : settings_(settings),
      options_(options),
      ego_(ego ? std::optional(*ego) : std::nullopt),
      lag_(with_hook(options.lag)) {
  if (options.hypotheses) hypotheses_.emplace(hypotheses_noise(settings.noise));
}

/// The caller's own hook comes first: when it throws, nothing is told to have left.
FixedLagOptions OnlineWindow::with_hook(FixedLagOptions options) {
  options.leaving = [this, own = std::move(options.leaving)](double t) {
    if (own) own(t);
    if (!on_leave || !chain_) return;
    for (const EgoKeyframe& k : chain_->keyframes())
      if (std::abs(k.t - t) < kSameInstant) on_leave({k.t, chain_->state(k)});
  };
  return options;
}

void OnlineWindow::start_chaser(const Alignment& alignment, const std::vector<ImuSample>& samples) {
  chain_.emplace(lag_.problem(), *ego_, options_.ego);
  for (const ImuSample& sample : samples) chain_->add(sample);
  join(chain_->start(alignment.t, alignment.state, alignment.spread));
}

void OnlineWindow::join(const EgoKeyframe& k) {
  fall_behind();
  if (options_.ego.preintegrated_dvl) covariance_ = Covariance::stale;  // its sums may have been made anew
  lag_.track(k.t, k.pose);
  lag_.track(k.t, k.velocity);
  if (k.bias) lag_.track(k.t, *k.bias);
}

void OnlineWindow::add_keyframe(double t, const SE3& dead_reckoned, std::size_t sensor, const Measurement* first) {
  fall_behind();
  const EgoKeyframe* ego = nullptr;
  if (chain_) {
    ego = &chain_->extend(t);
    join(*ego);
  }
  if (!has_target() && first) make_target();
  with_target([&]<LieGroup G>(TargetWindow<G>& window) {
    const Variable<G>* chaser = nullptr;
    if constexpr (std::same_as<G, SE3>) chaser = ego ? &ego->pose : nullptr;
    window.add_keyframe(t, dead_reckoned, chaser, sensor, first);
    join_newest(window);
  });
  if (hypotheses_) hypotheses_->add(t, {});
}

void OnlineWindow::start_target(std::size_t sensor, const Measurement& m) {
  fall_behind();
  make_target();
  const EgoKeyframe& ego = chain_->keyframes().back();
  TargetWindow<SE3>& window = *std::get<Target<SE3>>(target_);
  window.add_keyframe(ego.t, SE3(), &ego.pose, sensor, &m);
  join_newest(window);
}

void OnlineWindow::make_target() {
  if (settings_.planar) {
    target_ = std::make_unique<TargetWindow<SE2>>(lag_.problem(), settings_, options_.tracking);
  } else {
    target_ = std::make_unique<TargetWindow<SE3>>(lag_.problem(), settings_, options_.tracking);
  }
}

template <LieGroup G>
void OnlineWindow::join_newest(const TargetWindow<G>& window) {
  window.each_new_variable([&](double t, const auto& x) { lag_.track(t, x); });
}

/// Biases that newer ones have taken the place of may leave from now on.
template <class Sensors>
void OnlineWindow::join_biases(Sensors& sensors, bool unknown) {
  if (unknown) fall_behind();
  sensors.each_left_bias([&](double t, const auto& x) { lag_.track(std::max(t, lag_.oldest()), x); });
}

/// What has been added says by itself what is expected of it; but for what comes right before, nothing is taken out.
void OnlineWindow::fall_behind() {
  if (covariance_ == Covariance::there) covariance_ = Covariance::behind;
  if (covariance_ == Covariance::none) covariance_ = Covariance::stale;
}

/// Whether there is a covariance of what is expected, before it is measured.
bool OnlineWindow::predicts() {
  if (!std::isfinite(options_.reset.gate)) return false;
  if (covariance_ == Covariance::behind) covariance_ = lag_.extend() ? Covariance::there : Covariance::stale;
  if (covariance_ == Covariance::stale) covariance_ = lag_.relinearize() ? Covariance::there : Covariance::none;
  return covariance_ == Covariance::there;
}

bool OnlineWindow::passes(const Block& block, Eigen::Index rows, bool gated, Outcome& outcome) const {
  if (gated) outcome.sigmas = innovation_sigmas(lag_, block, rows);
  const double gate = options_.reset.gate;
  outcome.rejected = outcome.sigmas ? !(*outcome.sigmas <= gate) : !has_finite_cost(lag_.problem(), block);
  if (outcome.rejected && !outcome.sigmas) outcome.sigmas = HUGE_VAL;
  return !outcome.rejected;
}

/// An estimate that had not converged has no say yet against a measurement: it is solved to its minimum first, once.
bool OnlineWindow::settles_first() {
  if (std::exchange(converged_, true)) return false;
  minimize();
  covariance_ = Covariance::stale;
  return true;
}

/// The first of a sensor with errors that stay makes the constants among these, which the gate has to have covariances of:
/// it is added once more then.
OnlineWindow::Outcome OnlineWindow::add_measurement(std::size_t sensor, const Measurement& m) {
  Outcome outcome;
  with_target([&](auto& window) { join_biases(window, window.prepare(sensor, m)); });
  const bool gated = predicts();
  const int known = lag_.problem().num_variables();
  bool unknown = false;
  with_target([&](auto& window) {
    outcome.why_not = window.add_measurement(sensor, m);
    if (outcome.why_not) return;
    unknown = gated && lag_.problem().num_variables() > known;
    if (unknown) return window.withdraw_last();
    const bool pose = settings_.sensors[sensor].type->has(measured::rotation);
    const Block& block = window.last_block();
    const Eigen::Index dim = lag_.problem().noise(block).dim();
    if (!passes(block, pose ? std::min<Eigen::Index>(dim, settings_.planar ? 2 : 3) : dim, gated, outcome))
      window.withdraw_last();
  });
  if (unknown) fall_behind();
  if (unknown || (outcome.rejected && gated && settles_first())) return add_measurement(sensor, m);
  if (hypotheses_ && !outcome.rejected && !outcome.why_not) note_fix(sensor, m);
  return outcome;
}

OnlineWindow::Outcome OnlineWindow::attach(std::size_t sensor, const EgoMeasurement& m, double t) {
  Outcome outcome;
  join_biases(*chain_, chain_->prepare(sensor, t));
  const bool gated = predicts();
  const int known = lag_.problem().num_variables();
  const PlacedEgoMeasurement placed = chain_->attach(sensor, m, t);
  if (!placed.block && t < newest()) covariance_ = Covariance::stale;     // sums of velocities were made anew
  if (placed.block && gated && lag_.problem().num_variables() > known) {  // as above
    lag_.problem().remove(*placed.block);
    fall_behind();
    return attach(sensor, m, t);
  }
  if (placed.block && !passes(*placed.block, lag_.problem().noise(*placed.block).dim(), gated, outcome))
    lag_.problem().remove(*placed.block);
  return outcome.rejected && gated && settles_first() ? attach(sensor, m, t) : outcome;
}

/// In the frame of dead reckoning: a smoother moves the chaser too when a target is not where it was expected to be.
void OnlineWindow::note_fix(std::size_t sensor, const Measurement& m) {
  const TargetSensor& by = settings_.sensors[sensor];
  with_target([&](const auto& window) {
    const double t = by.valid_at(m);
    const std::vector<Keyframe>& keyframes = window.keyframes();
    const auto after = std::lower_bound(keyframes.begin(), keyframes.end(), t - kSameInstant,
                                        [](const Keyframe& k, double x) { return k.t < x; });
    const auto k = std::min(std::size_t(after - keyframes.begin()), keyframes.size() - 1);
    SE3 chaser = window.dead_reckoned(k);
    if (k > 0 && keyframes[k].t > t + kSameInstant)
      chaser = interpolate(window.dead_reckoned(k - 1), chaser,
                           (t - keyframes[k - 1].t) / (keyframes[k].t - keyframes[k - 1].t));
    hypotheses_->add(t, target_fix(by, m, chaser, options_.tracking));
  });
}

Summary OnlineWindow::update() {
  const Summary summary = slide();
  return has_target() && restart_due() ? restart(summary) : summary;
}

/// Of a window that is bounded by the number of keyframes [s]; infinite while it grows.
double OnlineWindow::span() const {
  const int most = options_.lag.max_keyframes;
  return most > 0 && keyframes() >= std::size_t(most) ? newest() - oldest() : HUGE_VAL;
}

/// Those that were measured so long ago, too: a measurement is to have told of its sensor's delay long before it leaves.
void OnlineWindow::tell_delays(double reach) {
  with_target([&](auto& window) { window.tell_delays(reach); });
}

/// Chain and target forget what leaves, also when not all that is old does.
Summary OnlineWindow::slide() {
  const auto forget = [&] {
    const double oldest = lag_.oldest() - 0.5 * kSameInstant;
    if (chain_) chain_->drop_before(oldest);
    with_target([&](auto& window) { window.drop_before(oldest); });
    if (hypotheses_) hypotheses_->forget_before(oldest);
  };
  tell_delays(0.5 * std::min(options_.lag.window, span()));
  Summary summary;
  covariance_ = Covariance::stale;
  try {
    summary = lag_.update();
  } catch (...) {
    forget();
    throw;
  }
  forget();
  converged_ = summary.converged();
  if (converged_ && lag_.has_covariance()) covariance_ = Covariance::there;
  cost_ = summary.cost;
  return summary;
}

double OnlineWindow::minimize() {
  GaussNewtonOptions options;
  options.max_iterations = kSettlingIterations;
  options.cost_tolerance = kSettled;
  return solve(lag_.problem(), options).cost;
}

Summary OnlineWindow::settle() {
  tell_delays(0);
  minimize();
  return slide();
}

bool OnlineWindow::restart_due() {
  const double age = newest() - of_target([](const auto& w) { return w.keyframes().front().t; }, 0.0);
  const double surprise = of_target([](const auto& w) { return w.surprise(); }, 0.0);
  return restarts_.due(newest(), age, age < options_.lag.window - settings_.keyframe_interval, surprise);
}

/// The better of where the window is and where a fresh start leads.
Summary OnlineWindow::restart(const Summary& before) {
  Summary best = before;
  with_target([&](auto& window) {
    const auto kept = window.values();
    auto fresh = kept;
    try {
      fresh = window.fresh_start();
    } catch (const Error&) {  // too little to start from
      return;
    }
    window.set_values(fresh);
    if (!(minimize() < cost_)) {
      window.set_values(kept);
      minimize();
    }
    best = slide();
  });
  return best;
}

}  // namespace tandem::detail
