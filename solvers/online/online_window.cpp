#include <algorithm>
#include <utility>

#include <tandem/lie/error.hpp>
#include <tandem/lie/operations.hpp>
#include <tandem/solvers/augmented_lagrangian.hpp>
#include <tandem/solvers/online/innovation_gate.hpp>
#include <tandem/solvers/online/online_window.hpp>
#include <tandem/solvers/online/target_fix.hpp>

namespace tandem::detail {
namespace {

constexpr int kMaxMinimizeIterations = 100;
constexpr double kMinimizeTolerance = 1e-7;  // relative decrease of the cost

}  // namespace

OnlineWindow::OnlineWindow(const TrackingData& settings, const NavigationData* ego, const OnlineOptions& options)
    : settings_(settings),
      options_(options),
      ego_(ego ? std::optional(*ego) : std::nullopt),
      lag_(with_hook(options.lag)) {
  if (options.hypotheses)
    hypotheses_.emplace(hypotheses_noise(settings.noise), hypotheses_limits(options.tracking, settings.noise));
}

/// Calls the caller's hook before on_leave, so that no state is reported if the hook throws.
FixedLagOptions OnlineWindow::with_hook(FixedLagOptions options) {
  options.before_marginalize = [this, own = std::move(options.before_marginalize)](double t) {
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
  track_keyframe(chain_->start(alignment.t, alignment.state, alignment.sigmas));
}

void OnlineWindow::track_keyframe(const EgoKeyframe& k) {
  mark_covariance_extendable();
  if (options_.ego.preintegrated_dvl) covariance_ = Covariance::stale;  // velocities may have been preintegrated again
  lag_.track(k.t, k.pose);
  lag_.track(k.t, k.velocity);
  if (k.bias) lag_.track(k.t, *k.bias);
}

void OnlineWindow::add_keyframe(double t, const SE3& dead_reckoned, std::size_t sensor, const Measurement* first) {
  mark_covariance_extendable();
  const EgoKeyframe* ego = nullptr;
  if (chain_) {
    ego = &chain_->extend(t);
    track_keyframe(*ego);
  }
  if (!has_target() && first) make_target();
  with_target([&]<LieGroup G>(TargetWindow<G>& window) {
    const Variable<G>* chaser = nullptr;
    if constexpr (std::same_as<G, SE3>) chaser = ego ? &ego->pose : nullptr;
    window.add_keyframe(t, dead_reckoned, chaser, sensor, first);
    track_newest(window);
  });
  if (hypotheses_) hypotheses_->add(t, {});
}

void OnlineWindow::start_target(std::size_t sensor, const Measurement& m) {
  mark_covariance_extendable();
  make_target();
  const EgoKeyframe& ego = chain_->keyframes().back();
  TargetWindow<SE3>& window = *std::get<Target<SE3>>(target_);
  window.add_keyframe(ego.t, SE3(), &ego.pose, sensor, &m);
  track_newest(window);
}

void OnlineWindow::make_target() {
  if (settings_.planar) {
    target_ = std::make_unique<TargetWindow<SE2>>(lag_.problem(), settings_, options_.tracking);
  } else {
    target_ = std::make_unique<TargetWindow<SE3>>(lag_.problem(), settings_, options_.tracking);
  }
}

template <LieGroup G>
void OnlineWindow::track_newest(const TargetWindow<G>& window) {
  window.each_new_variable([&](double t, const auto& x) { lag_.track(t, x); });
}

/// Lets biases that newer ones have replaced leave the window.
template <class Sensors>
void OnlineWindow::track_replaced_biases(Sensors& sensors, bool unknown) {
  if (unknown) mark_covariance_extendable();
  sensors.each_superseded_bias([&](double t, const auto& x) { lag_.track(std::max(t, lag_.oldest()), x); });
}

/// Must be called when variables are added. The covariance can be extended to them by their own residuals.
void OnlineWindow::mark_covariance_extendable() {
  if (covariance_ == Covariance::current) covariance_ = Covariance::extendable;
  if (covariance_ == Covariance::unavailable) covariance_ = Covariance::stale;
}

/// Updates the covariance for the gate. Returns whether a covariance exists.
bool OnlineWindow::update_covariance() {
  if (!std::isfinite(options_.reset.gate)) return false;
  if (covariance_ == Covariance::extendable) covariance_ = lag_.extend() ? Covariance::current : Covariance::stale;
  if (covariance_ == Covariance::stale)
    covariance_ = lag_.relinearize() ? Covariance::current : Covariance::unavailable;
  return covariance_ == Covariance::current;
}

bool OnlineWindow::passes(const Block& block, Eigen::Index rows, bool use_gate, Outcome& outcome) try {
  NormalizedInnovation& of = outcome.innovation;
  if (const auto innovation = use_gate ? normalized_innovation(lag_, block, rows) : std::nullopt) {
    of = {innovation->sigmas, innovation->nis, std::size_t(innovation->rows), innovation->standardised};
    if (const Loss loss = lag_.problem().loss(block); loss.kind != Loss::Kind::none) {
      of.down_weighted = loss(of.nis).d1 < kDownweightThreshold;
      of.expected_down_weighted = expectations_(loss, int(rows)).down_weighted;
    }
  }
  const double gate = options_.reset.gate;
  outcome.rejected = of.sigmas ? !(*of.sigmas <= gate) : !has_finite_cost(lag_.problem(), block);
  if (outcome.rejected && !of.sigmas) of.sigmas = HUGE_VAL;
  return !outcome.rejected;
} catch (const UndefinedResidualError&) {
  outcome.rejected = true;
  outcome.innovation.sigmas = HUGE_VAL;
  return false;
}

/// If the last update did not converge, solves the window to its minimum and returns true: the gate is then applied
/// again.
bool OnlineWindow::minimize_once() {
  if (std::exchange(converged_, true)) return false;
  minimize();
  covariance_ = Covariance::stale;
  return true;
}

/// The first measurement of a sensor with systematic errors creates their variables. The gate needs the covariance of
/// these, so the measurement is then withdrawn, and added again after an update of the covariance.
OnlineWindow::Outcome OnlineWindow::add_measurement(std::size_t sensor, const Measurement& m) {
  Outcome outcome;
  with_target([&](auto& window) { track_replaced_biases(window, window.prepare_bias(sensor, m)); });
  const bool use_gate = update_covariance();
  const int known = lag_.problem().num_variables();
  bool unknown = false;
  with_target([&](auto& window) {
    outcome.why_not = window.add_measurement(sensor, m);
    if (outcome.why_not) return;
    unknown = use_gate && lag_.problem().num_variables() > known;
    if (unknown) return window.remove_last_measurement();
    const bool pose = settings_.sensors[sensor].type->has(measured::rotation);
    const Block& block = window.last_block();
    const Eigen::Index dim = lag_.problem().noise(block).dim();
    if (!passes(block, pose ? std::min<Eigen::Index>(dim, settings_.planar ? 2 : 3) : dim, use_gate, outcome))
      window.remove_last_measurement();
  });
  if (unknown) mark_covariance_extendable();
  if (unknown || (outcome.rejected && use_gate && minimize_once())) return add_measurement(sensor, m);
  if (hypotheses_ && !outcome.rejected && !outcome.why_not) add_fix_to_hypotheses(sensor, m);
  return outcome;
}

OnlineWindow::Outcome OnlineWindow::attach(std::size_t sensor, const EgoMeasurement& m, double t) {
  Outcome outcome;
  track_replaced_biases(*chain_, chain_->prepare_bias(sensor, t));
  const bool use_gate = update_covariance();
  const int known = lag_.problem().num_variables();
  const PlacedEgoMeasurement placed = chain_->attach(sensor, m, t);
  if (!placed.block && t < newest()) covariance_ = Covariance::stale;        // velocities were preintegrated again
  if (placed.block && use_gate && lag_.problem().num_variables() > known) {  // as in add_measurement()
    lag_.problem().remove(*placed.block);
    mark_covariance_extendable();
    return attach(sensor, m, t);
  }
  if (placed.block && !passes(*placed.block, lag_.problem().noise(*placed.block).dim(), use_gate, outcome))
    lag_.problem().remove(*placed.block);
  return outcome.rejected && use_gate && minimize_once() ? attach(sensor, m, t) : outcome;
}

/// Adds a fix to the hypotheses in the dead-reckoning frame, because an unexpected fix also moves the chaser's
/// estimate.
void OnlineWindow::add_fix_to_hypotheses(std::size_t sensor, const Measurement& m) {
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
  return has_target() && fresh_start_due() ? solve_from_fresh_start(summary) : summary;
}

/// Returns the duration of a window that is limited by the number of keyframes [s]; infinite while it grows.
double OnlineWindow::span() const {
  const int most = options_.lag.max_keyframes;
  return most > 0 && keyframes() >= std::size_t(most) ? newest() - oldest() : HUGE_VAL;
}

/// Lets measurements at least `reach` [s] old depend on the estimated delay, long before they leave the window.
void OnlineWindow::free_delays(double reach) {
  with_target([&](auto& window) { window.free_delays(reach); });
}

/// Updates the fixed-lag smoother. Chain and target drop the states that have left, also if the update throws.
Summary OnlineWindow::slide() {
  const auto forget = [&] {
    const double oldest = lag_.oldest() - 0.5 * kSameInstant;
    if (chain_) chain_->drop_before(oldest);
    with_target([&](auto& window) { window.drop_before(oldest); });
    if (hypotheses_) hypotheses_->forget_before(oldest);
  };
  free_delays(0.5 * std::min(options_.lag.window, span()));
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
  if (converged_ && lag_.has_covariance()) covariance_ = Covariance::current;
  cost_ = summary.cost;
  return summary;
}

double OnlineWindow::minimize() {
  AugmentedLagrangianOptions options;
  options.max_iterations = kMaxMinimizeIterations;
  options.from_multipliers = true;
  options.cost_tolerance = kMinimizeTolerance;
  return solve(lag_.problem(), options).cost;
}

Summary OnlineWindow::solve_to_convergence() {
  free_delays(0);
  minimize();
  return slide();
}

bool OnlineWindow::fresh_start_due() {
  const double age = newest() - of_target([](const auto& w) { return w.keyframes().front().t; }, 0.0);
  const double surprise = of_target([](const auto& w) { return w.orientation_innovation(); }, 0.0);
  return restarts_.due(newest(), age, age < options_.lag.window - settings_.keyframe_interval, surprise);
}

/// Solves also from a fresh start, and keeps the solution with the lower cost.
Summary OnlineWindow::solve_from_fresh_start(const Summary& before) {
  Summary best = before;
  with_target([&](auto& window) {
    const auto current = window.values();
    auto fresh = current;
    try {
      fresh = window.initial_guess();
    } catch (const BadInputError&) {  // too few measurements for an initial guess
      return;
    }
    window.set_values(fresh);
    if (!(minimize() < cost_)) {
      window.set_values(current);
      minimize();
    }
    best = slide();
  });
  return best;
}

}  // namespace tandem::detail
