#include <algorithm>
#include <cmath>
#include <utility>

#include <tandem/lie/error.hpp>
#include <tandem/problem/navigation/ego_chain.hpp>
#include <tandem/problem/navigation/ego_placement.hpp>
#include <tandem/problem/navigation/systematic_error_checks.hpp>
#include <tandem/residuals/coasting.hpp>
#include <tandem/residuals/gauss_markov.hpp>
#include <tandem/residuals/imu_prediction.hpp>
#include <tandem/residuals/preintegrated_imu.hpp>
#include <tandem/residuals/prior.hpp>
#include <tandem/residuals/relative_pose.hpp>

namespace tandem {
namespace {

/// Lower bounds of standard deviations that keep the covariance of noise-free axes regular: m, and m/s² or rad/s.
constexpr double kMinPositionSigma = 1e-5, kMinBiasSigma = 1e-9;

/// Measurements share a bias state if the bias changes by less than this fraction of the sensor's noise between them.
constexpr double kMaxBiasStep = 0.02;

/// Returns why a sensor cannot have its systematic errors, or an empty string.
std::string why_unsupported(const EgoSensor& sensor, bool imu) {
  if (!sensor.error) return "";
  const SystematicError& error = *sensor.error;
  const EgoReading reading = sensor.type->reading;
  const std::string kind = "a " + std::string(name(sensor.type));
  if (error.misalignment_sigma > 0 && reading == EgoReading::orientation)
    return "the misalignment of " + kind + " is its bias; give `sigma` instead";
  const bool vector = reading == EgoReading::body_vector;
  if (const std::string why =
          tandem::why_unsupported(error, kind, vector || reading == EgoReading::world_height, vector);
      !why.empty())
    return why;
  if (error.delay_sigma > 0 && !imu) return "estimating a delay needs an imu; remove `delay`";
  return "";
}

/// Returns a covariance along body axes, given independent standard deviations along world axes.
Matrix<3, 3> in_body(const SO3& R, const Vector<3>& sigma) {
  const Matrix<3, 3> M = R.matrix();
  return M.transpose() * sigma.cwiseAbs2().asDiagonal() * M;
}

}  // namespace

EgoState state_at(const Problem& problem, const EgoKeyframe& k) {
  EgoState state{problem.value(k.pose), problem.value(k.velocity).vector(), k.preintegration_bias};
  if (k.bias) state.bias = problem.value(*k.bias).vector();
  return state;
}

EgoChain::EgoChain(Problem& problem, const NavigationData& data, const EgoOptions& options)
    : problem_(&problem), earth_(data.earth), options_(options) {
  if (!(options.dvl_max_age > 0))
    throw BadInputError("the maximum age of a DVL velocity (dvl_max_age) must be positive");
  for (const EgoSensor& sensor : data.sensors) {
    if (sensor.sigma.size() != rows(sensor.type))
      throw BadInputError(sensor.name + ": a " + std::string(name(sensor.type)) + " needs " +
                          std::to_string(rows(sensor.type)) + " standard deviations, not " +
                          std::to_string(sensor.sigma.size()));
    if (sensor.error && sensor.error->has_bias() && sensor.error->bias_sigma.size() != rows(sensor.type))
      throw BadInputError(error_name(sensor.name) + ": a " + std::string(name(sensor.type)) + " needs " +
                          std::to_string(rows(sensor.type)) + " standard deviations, not " +
                          std::to_string(sensor.error->bias_sigma.size()));
    if (sensor.error)
      if (const std::string why = why_invalid(*sensor.error); !why.empty())
        throw BadInputError(error_name(sensor.name) + ": " + why);
    if (const std::string why = why_unsupported(sensor, data.imu.has_value()); !why.empty())
      throw BadInputError(error_name(sensor.name) + ": " + why);
    if (sensor.error && options.preintegrated_dvl && sensor.type == EgoSensorType::dvl)
      throw BadInputError(sensor.name +
                          ": preintegrated DVL velocities do not support systematic errors; remove one of the two");
    if (sensor.error && sensor.error->scale_sigma > 0 && options.dvl_scale && sensor.type == EgoSensorType::dvl)
      throw BadInputError(error_name(sensor.name) +
                          ": --dvl-scale estimates the scale factor already; remove one of the two");
    EgoSensor& own = sensors_.emplace_back(sensor);
    own.measurements.clear();
  }
  biases_.resize(sensors_.size());
  if (!data.imu) return;
  imu_.emplace(*data.imu);
  if (options.preintegrated_dvl) dvl_.emplace(options.dvl_max_age, options.loss);
  initial_accelerometer_bias_ = data.imu->accelerometer_bias_sigma();
  initial_gyroscope_bias_ = data.imu->gyroscope_bias_sigma();
}

bool EgoChain::add(const ImuSample& sample) { return imu_ && imu_->add(sample); }

const EgoKeyframe& EgoChain::start(double t, const EgoState& prior, const EgoStateSigmas& sigmas,
                                   const std::optional<EgoState>& guess) {
  if (!keyframes_.empty()) throw BadInputError("EgoChain::start() may be called only once");
  const EgoKeyframe& k = add_keyframe(t, guess.value_or(prior));
  Matrix<6, 6> covariance = Matrix<6, 6>::Zero();
  covariance.topLeftCorner<3, 3>() = in_body(prior.pose.rotation(), sigmas.position);
  covariance.bottomRightCorner<3, 3>() = in_body(prior.pose.rotation(), sigmas.rotation);
  problem_->minimize(Prior<SE3>{prior.pose}, Gaussian::covariance(covariance), {k.pose});
  problem_->minimize(Prior<R3>{R3(prior.velocity)}, Gaussian(Eigen::VectorXd(sigmas.velocity)), {k.velocity});
  if (k.bias) {
    Vector<6> sigma;
    sigma << Vector<3>::Constant(initial_accelerometer_bias_), Vector<3>::Constant(initial_gyroscope_bias_);
    problem_->minimize(Prior<Rn<6>>{sigmas.bias ? Rn<6>(prior.bias) : Rn<6>()},
                       Gaussian(Eigen::VectorXd(sigmas.bias.value_or(sigma))), {*k.bias});
  }
  if (options_.dvl_scale) {
    scale_ = problem_->add(Rn<1>(), "DVL scale");
    problem_->minimize(Prior<Rn<1>>{Rn<1>()}, Gaussian{options_.dvl_scale_sigma}, {*scale_});
  }
  return k;
}

const EgoKeyframe& EgoChain::add_keyframe(double t, const EgoState& state) {
  EgoKeyframe k{t, {}, {}, {}, state.bias};
  const std::string at = " at " + std::to_string(t) + " s";
  k.pose = problem_->add(state.pose, "chaser" + at);
  k.velocity = problem_->add(R3(state.velocity), "velocity" + at);
  if (imu_) k.bias = problem_->add(Rn<6>(state.bias), "IMU bias" + at);
  sum_.reset();
  return keyframes_.emplace_back(k);
}

const EgoKeyframe& EgoChain::extend(double t, const std::optional<EgoState>& guess) {
  if (keyframes_.empty() || !(t > keyframes_.back().t))
    throw BadInputError("the chaser's keyframe at " + std::to_string(t) + " s is not later than the one before");
  const EgoState state = guess ? *guess : predicted(t);
  const EgoKeyframe from = keyframes_.back();
  const bool tied = imu_ && imu_->covers(from.t, t);
  std::optional<ImuPreintegrator> sum;
  if (tied) sum = sum_to(t);
  const EgoKeyframe& to = add_keyframe(t, state);
  if (tied) {
    Matrix<15, 15> covariance = sum->covariance();
    covariance.diagonal().head<3>().array() += kMinPositionSigma * kMinPositionSigma;
    covariance.diagonal().tail<6>().array() += kMinBiasSigma * kMinBiasSigma;
    problem_->minimize(PreintegratedImu{sum->delta(), earth_}, Gaussian::covariance(covariance),
                       {from.pose, from.velocity, *from.bias, to.pose, to.velocity, *to.bias});
    if (dvl_)
      dvl_->connect({from.t, from.pose, from.preintegration_bias.tail<3>()},
                    {to.t, to.pose, to.preintegration_bias.tail<3>()}, dvl_context());
  } else {
    coast(from, to);
  }
  return to;
}

void EgoChain::coast(const EgoKeyframe& from, const EgoKeyframe& to) {
  const double dt = to.t - from.t;
  problem_->minimize(Coasting{dt},
                     Gaussian::covariance(Coasting::covariance(std::pow(options_.coasting_acceleration, 2),
                                                               std::pow(options_.coasting_turn_rate, 2), dt)),
                     {from.pose, from.velocity, to.pose, to.velocity});
  if (!imu_) return;
  if (!splits_.empty() && splits_.back().second == from.t) {
    splits_.back().second = to.t;
  } else {
    splits_.emplace_back(from.t, to.t);
  }
  const ImuNoise& noise = imu_->noise();
  Vector<6> walk;
  walk << Vector<3>::Constant(noise.accelerometer_bias_walk), Vector<3>::Constant(noise.gyroscope_bias_walk);
  walk = (walk * std::sqrt(dt)).cwiseMax(kMinBiasSigma);
  problem_->minimize(RelativePose<Rn<6>>{Rn<6>()}, Gaussian(Eigen::VectorXd(walk)), {*from.bias, *to.bias});
}

const ImuPreintegrator& EgoChain::sum_to(double t) const {
  const EgoKeyframe& newest = keyframes_.back();
  if (!sum_ || sum_->t > t) sum_ = Sum{newest.t, imu_->start(newest.preintegration_bias)};
  imu_->integrate(sum_->t, t, sum_->preintegrated);
  sum_->t = t;
  return sum_->preintegrated;
}

EgoState EgoChain::predicted(double t) const {
  const EgoKeyframe& newest = keyframes_.back();
  EgoState now = state(newest);
  if (!(t > newest.t)) return now;
  if (!imu_ || !imu_->covers(newest.t, t)) {
    now.pose = SE3(now.pose.rotation(), now.pose.translation() + (t - newest.t) * now.velocity);
    return now;
  }
  const auto then = predict(now.pose, R3(now.velocity), Rn<6>(now.bias), sum_to(t).delta(), earth_);
  now.pose = then.pose;
  now.velocity = then.velocity.vector();
  return now;
}

const EgoKeyframe* EgoChain::before(double t) const {
  const auto after = std::upper_bound(keyframes_.begin(), keyframes_.end(), t + kSameInstant,
                                      [](double x, const EgoKeyframe& k) { return x < k.t; });
  return after == keyframes_.begin() ? nullptr : &*(after - 1);
}

bool EgoChain::can_attach(double t) const {
  const EgoKeyframe* k = before(t);
  return k && (t - k->t <= kSameInstant || (imu_ && imu_->covers(k->t, t)));
}

bool EgoChain::prepare_bias(std::size_t sensor, double t) {
  const std::optional<EgoBias> last = biases_[sensor];
  if (!update_bias(sensor, t)) return false;
  if (last) {
    const EgoKeyframe* const with = before(last->last_used);
    superseded_biases_.push_back({with ? with->t : keyframes_.front().t, last->state});
  }
  return true;
}

PlacedEgoMeasurement EgoChain::attach(std::size_t index, const EgoMeasurement& m, double t) {
  const EgoSensor& sensor = sensors_[index];
  const EgoKeyframe* k = before(t);
  if (!can_attach(t))
    throw BadInputError(sensor.name + ": the measurement at " + std::to_string(t) +
                        " s is before the first keyframe, or no IMU samples connect it to a keyframe");
  if (dvl_ && sensor.type == EgoSensorType::dvl) {
    dvl_->add({t, m.value, index}, dvl_context());
    return {index, t, {}};
  }
  std::optional<ImuDelta> delta;
  if (t - k->t > kSameInstant) {
    if (k == &keyframes_.back()) {
      delta = sum_to(t).delta();
    } else {
      ImuPreintegrator sum = imu_->start(k->preintegration_bias);
      imu_->integrate(k->t, t, sum);
      delta = sum.delta();
    }
  }
  const std::optional<Block> bias_block = update_bias(index, t);
  if (biases_[index]) biases_[index]->last_used = std::max(biases_[index]->last_used, t);
  std::optional<ImuSample> motion;
  if (sensor.error && sensor.error->delay_sigma > 0)
    motion = motion_about(t, 2 * sensor.error->delay_sigma, k->preintegration_bias);
  const Block block = sensor.type->place(
      {*problem_, *k, delta ? &*delta : nullptr, earth_, scale_, sensor, sensor.loss.value_or(options_.loss),
       biases_[index] ? &*biases_[index] : nullptr, motion ? &*motion : nullptr, constants_},
      m);
  return {index, t, block, bias_block};
}

std::optional<ImuSample> EgoChain::motion_about(double t, double seconds, const Vector<6>& bias) const {
  constexpr double kMinLength = 0.1;  // s; the interval must contain some samples
  const double half = 0.5 * std::max(seconds, kMinLength);
  auto mean = imu_->mean(t - half, t + half);
  if (!mean) return {};
  const SO3& R = imu_->mount().rotation();
  mean->specific_force -= R.act(bias.head<3>());
  mean->angular_rate -= R.act(bias.tail<3>());
  return mean;
}

std::optional<Block> EgoChain::update_bias(std::size_t index, double t) {
  const EgoSensor& sensor = sensors_[index];
  std::optional<EgoBias>& newest = biases_[index];
  if (!sensor.error || !sensor.error->has_bias()) return {};
  if (newest) {
    const double scale = GaussMarkov<1>::after(std::abs(t - newest->t), sensor.error->correlation_time).noise_scale();
    if ((scale * sensor.error->bias_sigma.array() <= kMaxBiasStep * sensor.sigma.array()).all()) return {};
  }
  return sensor.error->bias_sigma.size() == 1 ? add_bias_state<1>(sensor, t, newest)
                                              : add_bias_state<3>(sensor, t, newest);
}

template <int N>
Block EgoChain::add_bias_state(const EgoSensor& sensor, double t, std::optional<EgoBias>& newest) {
  const auto next = problem_->add(Rn<N>(), error_name(sensor.name) + " at " + std::to_string(t) + " s");
  const Gaussian sigma(sensor.error->bias_sigma);
  const std::optional<EgoBias> last = std::exchange(newest, EgoBias{.t = t, .state = next});
  if (!last) {
    if (sensor.error->has_constant_bias()) constants_.add_bias(sensor.name, next, sensor.error->bias_sigma);
    return problem_->minimize(Prior<Rn<N>>{Rn<N>()}, sigma, {next});
  }
  const auto step = GaussMarkov<N>::after(std::abs(t - last->t), sensor.error->correlation_time);
  const auto before = std::get<Variable<Rn<N>>>(last->state);
  problem_->set_value(next, step.expected(problem_->value(before)));
  return problem_->minimize(step, sigma.scaled(step.noise_scale()), {before, next});
}

void EgoChain::drop_before(double t) {
  while (keyframes_.size() > 1 && keyframes_.front().t < t) keyframes_.pop_front();
  if (dvl_) dvl_->drop_before(t);
  if (imu_ && !keyframes_.empty()) imu_->drop_before(keyframes_.front().t);
}

}  // namespace tandem
