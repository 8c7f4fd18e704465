#include <tandem/lie/error.hpp>
#include <tandem/problem/navigation/systematic_error_checks.hpp>
#include <tandem/solvers/online/online_estimator.hpp>
#include <tandem/solvers/online/online_streams.hpp>

namespace tandem {
namespace {

using MaybeRejection = std::optional<Rejection>;

void check(const TrackingData& tracking, const std::optional<NavigationData>& ego, const OnlineOptions& options) {
  const TrackingOptions& o = options.tracking;
  check(o);
  if (o.model == MotionModel::steady_course)
    throw BadInputError("online estimation does not support the steady-course model, which spans a whole run");
  if (o.model == MotionModel::none)
    throw BadInputError(
        "online estimation needs a motion model of the target; without one its newest pose is unobservable");
  if (ego && tracking.planar)
    throw BadInputError(
        "a planar problem requires odometry; the chaser's own sensors are supported only in space (group SE3)");
  for (const TargetSensor& sensor : tracking.sensors) {
    if (!sensor.error) continue;
    const std::string what = error_name(sensor.name) + ": ";
    if (const std::string why = why_invalid(*sensor.error); !why.empty()) throw BadInputError(what + why);
    if (const std::string why = why_unsupported(sensor); !why.empty()) throw BadInputError(what + why);
    const bool split = o.position_share > 0 || orientation_loss_of(sensor, o);
    if (split && sensor.type->has(measured::rotation) && sensor.type->has(measured::position))
      throw BadInputError(
          what +
          "systematic errors of a pose need one residual for the whole pose; remove the separate orientation "
          "loss and the position share (--robust sets both)");
    if (const int n = rows(sensor.type, tracking.planar);
        sensor.error->has_bias() && sensor.error->bias_sigma.size() != n)
      throw BadInputError(what + "the bias needs " + std::to_string(n) + " standard deviations, not " +
                          std::to_string(sensor.error->bias_sigma.size()));
  }
  if (ego) {
    Problem scratch;
    EgoChain(scratch, *ego, options.ego);  // throws on invalid options
  }
  check(options.reset);
  if (const std::string why = why_hypotheses_unsupported(tracking, !ego); options.hypotheses && !why.empty())
    throw BadInputError("motion hypotheses are not supported: " + why);
  if (!ego && tracking.sensors.empty())
    throw BadInputError("nothing to estimate: there are no sensors of the chaser and none that observe a target");
}

}  // namespace

std::string why_hypotheses_unsupported(const TrackingData& tracking, bool by_odometry) {
  if (!by_odometry) return "the chaser moves by its own sensors, not by odometry";
  if (tracking.planar) return "the problem is planar";
  if (tracking.noise.constant_velocity.isZero(0)) return "the noise constant_velocity is zero";
  for (const TargetSensor& sensor : tracking.sensors) {
    const bool position =
        sensor.type->has(measured::position) ||
        (sensor.type->has(measured::range) && sensor.type->has(measured::direction | measured::angles));
    if (!position) return sensor.name + " does not measure a position";
    if (sensor.error) return sensor.name + " has systematic errors, which only the window estimates";
    if (!sensor.type->has(measured::rotation) && !sensor.marker.translation().isZero())
      return sensor.name + " observes a point that is not the target's origin; its position depends on the orientation";
  }
  return tracking.sensors.empty() ? "no sensor observes a target" : "";
}

OnlineEstimator::OnlineEstimator(const TrackingData& tracking, const std::optional<NavigationData>& ego,
                                 const OnlineOptions& options) {
  check(tracking, ego, options);
  streams_ = std::make_unique<Streams>(*this, tracking, ego, options);
}
OnlineEstimator::~OnlineEstimator() = default;

MaybeRejection OnlineEstimator::add_odometry(const Stamped<SE3>& pose) {
  return streams_->change([&](Streams& streams) { return streams.add_odometry(pose); });
}
MaybeRejection OnlineEstimator::add_imu(const ImuSample& sample) {
  return streams_->change([&](Streams& streams) { return streams.add_imu(sample); });
}
MaybeRejection OnlineEstimator::add_ego(std::size_t sensor, const EgoMeasurement& m) {
  return streams_->change([&](Streams& streams) { return streams.add_ego(sensor, m); });
}
MaybeRejection OnlineEstimator::add_target(std::size_t sensor, const Measurement& m) {
  return streams_->change([&](Streams& streams) { return streams.add_target(sensor, m); });
}
void OnlineEstimator::finish() {
  streams_->change([](Streams& streams) { streams.finish(); });
}
void OnlineEstimator::reset() { streams_->reset(); }
Summary OnlineEstimator::solve_to_convergence() {
  return streams_->change([](Streams& streams) { return streams.solve_to_convergence(); });
}

bool OnlineEstimator::started() const { return streams_->window().started(); }
bool OnlineEstimator::has_target() const { return streams_->window().has_target(); }
const TrackHealth& OnlineEstimator::health() const { return streams_->health(); }
std::optional<MotionHypotheses::Checkpoint> OnlineEstimator::hypotheses() const {
  return streams_->window().hypotheses();
}
void OnlineEstimator::restore(const TrackHealth& health,
                              const std::optional<MotionHypotheses::Checkpoint>& hypotheses) {
  streams_->change([&](Streams& streams) { streams.restore(health, hypotheses); });
}
std::optional<Alignment> OnlineEstimator::handover_start() const { return streams_->handover_start(); }
double OnlineEstimator::newest() const { return streams_->window().newest(); }
double OnlineEstimator::oldest() const { return streams_->window().oldest(); }
std::size_t OnlineEstimator::keyframes() const { return streams_->window().keyframes(); }
double OnlineEstimator::cost() const { return streams_->window().cost(); }
EgoState OnlineEstimator::chaser() const { return streams_->window().chaser(); }
std::optional<TargetState> OnlineEstimator::target() const { return streams_->window().target(); }
std::optional<Vector<3>> OnlineEstimator::target_velocity() const { return streams_->window().target_velocity(); }
SE3 OnlineEstimator::predicted_chaser(double h) const { return streams_->window().predicted_chaser(h); }
std::optional<TargetState> OnlineEstimator::predicted_target(double h) const {
  return streams_->window().predicted_target(h);
}
std::optional<RelativeTarget> OnlineEstimator::relative_target(double h) const {
  return streams_->window().relative_target(h);
}
OnlineEstimator::Covariance OnlineEstimator::covariance() const { return streams_->window().covariance(); }
bool OnlineEstimator::uses_hypotheses() const { return streams_->window().uses_hypotheses(); }
std::optional<TargetState> OnlineEstimator::window_target(double h) const {
  return streams_->window().window_target(h);
}
OnlineEstimator::Instant OnlineEstimator::at(double t) const { return streams_->at(t); }
std::vector<OnlineEstimator::SensorError> OnlineEstimator::sensor_errors() const {
  return streams_->window().sensor_errors();
}
std::vector<Stamped<EgoState>> OnlineEstimator::window() const { return streams_->window().states(); }
std::vector<std::pair<double, double>> OnlineEstimator::splits() const { return streams_->window().splits(); }
const std::vector<std::pair<double, double>>& OnlineEstimator::imu_exclusions() const {
  return streams_->imu_exclusions();
}

}  // namespace tandem
