#include <algorithm>
#include <cmath>
#include <utility>

#include <tandem/lie/error.hpp>
#include <tandem/problem/navigation/ego_chain.hpp>
#include <tandem/problem/navigation/ego_placing.hpp>
#include <tandem/problem/navigation/staying_error_checks.hpp>
#include <tandem/residuals/coasting.hpp>
#include <tandem/residuals/gauss_markov.hpp>
#include <tandem/residuals/imu_prediction.hpp>
#include <tandem/residuals/preintegrated_imu.hpp>
#include <tandem/residuals/prior.hpp>
#include <tandem/residuals/relative_pose.hpp>

namespace tandem {
namespace {

/// Below these, a covariance of noise-free axes would be singular: m, and m/s² or rad/s.
constexpr double kLeastPosition = 1e-5, kLeastBias = 1e-9;

/// Of the sensor's noise: measurements between which its error changes by less share a state of it.
constexpr double kErrorStep = 0.02;

/// Empty, or why a sensor cannot have the constants that are asked for.
std::string why_not(const EgoSensor& sensor, bool imu) {
  if (!sensor.error) return "";
  const StayingError& error = *sensor.error;
  const EgoReading reading = sensor.type->reading;
  const std::string kind = "a " + std::string(name(sensor.type));
  if (error.misalignment > 0 && reading == EgoReading::orientation)
    return "a misalignment of " + kind + " is its bias: give that (sigma)";
  const bool vector = reading == EgoReading::body_vector;
  if (const std::string why = tandem::why_not(error, kind, vector || reading == EgoReading::world_height, vector);
      !why.empty())
    return why;
  if (error.delay > 0 && !imu) return "its delay is estimated beside an imu alone; leave it out";
  return "";
}

/// The covariance of independent world axes, by the axes of a body.
Matrix<3, 3> in_body(const SO3& R, const Vector<3>& sigma) {
  const Matrix<3, 3> M = R.matrix();
  return M.transpose() * sigma.cwiseAbs2().asDiagonal() * M;
}

}  // namespace

EgoChain::EgoChain(Problem& problem, const NavigationData& data, const EgoOptions& options)
    : problem_(&problem), earth_(data.earth), options_(options) {
  if (!(options.dvl_greatest_age > 0))
    throw Error("the greatest age of a DVL's velocity (dvl_greatest_age) must be above zero");
  for (const EgoSensor& sensor : data.sensors) {
    if (sensor.sigma.size() != rows(sensor.type))
      throw Error(sensor.name + ": a " + std::string(name(sensor.type)) + " needs " +
                  std::to_string(rows(sensor.type)) + " standard deviations, not " +
                  std::to_string(sensor.sigma.size()));
    if (sensor.error && sensor.error->has_bias() && sensor.error->sigma.size() != rows(sensor.type))
      throw Error(error_name(sensor.name) + ": a " + std::string(name(sensor.type)) + " needs " +
                  std::to_string(rows(sensor.type)) + " standard deviations, not " +
                  std::to_string(sensor.error->sigma.size()));
    if (sensor.error)
      if (const std::string why = why_invalid(*sensor.error); !why.empty())
        throw Error(error_name(sensor.name) + ": " + why);
    if (const std::string why = why_not(sensor, data.imu.has_value()); !why.empty())
      throw Error(error_name(sensor.name) + ": " + why);
    if (sensor.error && options.preintegrated_dvl && sensor.type == EgoSensorType::dvl)
      throw Error(sensor.name + ": velocities that are summed up have no error that stays; leave one of both out");
    if (sensor.error && sensor.error->scale > 0 && options.dvl_scale && sensor.type == EgoSensorType::dvl)
      throw Error(error_name(sensor.name) + ": its scale is estimated already, by --dvl-scale; leave one of both out");
    EgoSensor& own = sensors_.emplace_back(sensor);
    own.measurements.clear();
  }
  errors_.resize(sensors_.size());
  if (!data.imu) return;
  imu_.emplace(*data.imu);
  if (options.preintegrated_dvl) dvl_.emplace(options.dvl_greatest_age, options.loss);
  initial_accelerometer_bias_ = data.imu->accelerometer_bias_spread();
  initial_gyroscope_bias_ = data.imu->gyroscope_bias_spread();
}

bool EgoChain::add(const ImuSample& sample) { return imu_ && imu_->add(sample); }

const EgoKeyframe& EgoChain::start(double t, const EgoState& prior, const EgoSpread& spread,
                                   const std::optional<EgoState>& guess) {
  if (!keyframes_.empty()) throw Error("a chain of ego keyframes starts once");
  const EgoKeyframe& k = add_keyframe(t, guess.value_or(prior));
  Matrix<6, 6> covariance = Matrix<6, 6>::Zero();
  covariance.topLeftCorner<3, 3>() = in_body(prior.pose.rotation(), spread.position);
  covariance.bottomRightCorner<3, 3>() = in_body(prior.pose.rotation(), spread.rotation);
  problem_->minimize(Prior<SE3>{prior.pose}, Gaussian::covariance(covariance), {k.pose});
  problem_->minimize(Prior<R3>{R3(prior.velocity)}, Gaussian(Eigen::VectorXd(spread.velocity)), {k.velocity});
  if (k.bias) {
    Vector<6> sigma;
    sigma << Vector<3>::Constant(initial_accelerometer_bias_), Vector<3>::Constant(initial_gyroscope_bias_);
    problem_->minimize(Prior<Rn<6>>{spread.bias ? Rn<6>(prior.bias) : Rn<6>()},
                       Gaussian(Eigen::VectorXd(spread.bias.value_or(sigma))), {*k.bias});
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
    throw Error("an ego keyframe at " + std::to_string(t) + " s is not later than the one before");
  const EgoState state = guess ? *guess : predicted(t);
  const EgoKeyframe from = keyframes_.back();
  const bool tied = imu_ && imu_->covers(from.t, t);
  std::optional<ImuPreintegrator> sum;
  if (tied) sum = sum_to(t);
  const EgoKeyframe& to = add_keyframe(t, state);
  if (tied) {
    Matrix<15, 15> covariance = sum->covariance();
    covariance.diagonal().head<3>().array() += kLeastPosition * kLeastPosition;
    covariance.diagonal().tail<6>().array() += kLeastBias * kLeastBias;
    problem_->minimize(PreintegratedImu{sum->delta(), earth_}, Gaussian::covariance(covariance),
                       {from.pose, from.velocity, *from.bias, to.pose, to.velocity, *to.bias});
    if (dvl_)
      dvl_->tie({from.t, from.pose, from.integrated_at.tail<3>()}, {to.t, to.pose, to.integrated_at.tail<3>()}, into());
  } else {
    coast(from, to);
  }
  return to;
}

void EgoChain::coast(const EgoKeyframe& from, const EgoKeyframe& to) {
  const double dt = to.t - from.t;
  problem_->minimize(Coasting{dt},
                     Gaussian::covariance(Coasting::covariance(std::pow(options_.coasting_acceleration, 2),
                                                               std::pow(options_.coasting_turn, 2), dt)),
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
  walk = (walk * std::sqrt(dt)).cwiseMax(kLeastBias);
  problem_->minimize(RelativePose<Rn<6>>{Rn<6>()}, Gaussian(Eigen::VectorXd(walk)), {*from.bias, *to.bias});
}

const ImuPreintegrator& EgoChain::sum_to(double t) const {
  const EgoKeyframe& newest = keyframes_.back();
  if (!sum_ || sum_->t > t) sum_ = Sum{newest.t, imu_->start(newest.integrated_at)};
  imu_->integrate(sum_->t, t, sum_->preintegrated);
  sum_->t = t;
  return sum_->preintegrated;
}

EgoState EgoChain::state(const EgoKeyframe& k) const {
  EgoState state{problem_->value(k.pose), problem_->value(k.velocity).vector(), k.integrated_at};
  if (k.bias) state.bias = problem_->value(*k.bias).vector();
  return state;
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

bool EgoChain::reaches(double t) const {
  const EgoKeyframe* k = before(t);
  return k && (t - k->t <= kSameInstant || (imu_ && imu_->covers(k->t, t)));
}

bool EgoChain::prepare(std::size_t sensor, double t) {
  const std::optional<EgoError> last = errors_[sensor];
  if (!error_at(sensor, t)) return false;
  if (last) {
    const EgoKeyframe* const with = before(last->last);
    left_errors_.push_back({with ? with->t : keyframes_.front().t, last->state});
  }
  return true;
}

PlacedEgoMeasurement EgoChain::attach(std::size_t index, const EgoMeasurement& m, double t) {
  const EgoSensor& sensor = sensors_[index];
  const EgoKeyframe* k = before(t);
  if (!reaches(t))
    throw Error(sensor.name + ": the measurement at " + std::to_string(t) + " s is out of reach of a keyframe");
  if (dvl_ && sensor.type == EgoSensorType::dvl) {
    dvl_->add({t, m.value, index}, into());
    return {index, t, {}};
  }
  std::optional<ImuDelta> delta;
  if (t - k->t > kSameInstant) {
    if (k == &keyframes_.back()) {
      delta = sum_to(t).delta();
    } else {
      ImuPreintegrator sum = imu_->start(k->integrated_at);
      imu_->integrate(k->t, t, sum);
      delta = sum.delta();
    }
  }
  const std::optional<Block> tie = error_at(index, t);
  if (errors_[index]) errors_[index]->last = std::max(errors_[index]->last, t);
  std::optional<ImuSample> motion;
  if (sensor.error && sensor.error->delay > 0) motion = motion_about(t, 2 * sensor.error->delay, k->integrated_at);
  const Block block = sensor.type->place(
      {*problem_, *k, delta ? &*delta : nullptr, earth_, scale_, sensor, sensor.loss.value_or(options_.loss),
       errors_[index] ? &*errors_[index] : nullptr, motion ? &*motion : nullptr, constants_},
      m);
  return {index, t, block, tie};
}

std::optional<ImuSample> EgoChain::motion_about(double t, double seconds, const Vector<6>& bias) const {
  constexpr double kLeast = 0.1;  // s, for some samples to be in it
  const double half = 0.5 * std::max(seconds, kLeast);
  auto mean = imu_->mean(t - half, t + half);
  if (!mean) return {};
  const SO3& R = imu_->mount().rotation();
  mean->specific_force -= R.act(bias.head<3>());
  mean->angular_rate -= R.act(bias.tail<3>());
  return mean;
}

std::optional<Block> EgoChain::error_at(std::size_t index, double t) {
  const EgoSensor& sensor = sensors_[index];
  std::optional<EgoError>& newest = errors_[index];
  if (!sensor.error || !sensor.error->has_bias()) return {};
  if (newest) {
    const double spread = GaussMarkov<1>::after(std::abs(t - newest->t), sensor.error->time).spread();
    if ((spread * sensor.error->sigma.array() <= kErrorStep * sensor.sigma.array()).all()) return {};
  }
  return sensor.error->sigma.size() == 1 ? tie_error<1>(sensor, t, newest) : tie_error<3>(sensor, t, newest);
}

template <int N>
Block EgoChain::tie_error(const EgoSensor& sensor, double t, std::optional<EgoError>& newest) {
  const auto next = problem_->add(Rn<N>(), error_name(sensor.name) + " at " + std::to_string(t) + " s");
  const Gaussian sigma(sensor.error->sigma);
  const std::optional<EgoError> last = std::exchange(newest, EgoError{.t = t, .state = next});
  if (!last) {
    if (sensor.error->has_constant_bias()) constants_.add_bias(sensor.name, next, sensor.error->sigma);
    return problem_->minimize(Prior<Rn<N>>{Rn<N>()}, sigma, {next});
  }
  const auto step = GaussMarkov<N>::after(std::abs(t - last->t), sensor.error->time);
  const auto before = std::get<Variable<Rn<N>>>(last->state);
  problem_->set_value(next, step.expected(problem_->value(before)));
  return problem_->minimize(step, sigma.scaled(step.spread()), {before, next});
}

void EgoChain::drop_before(double t) {
  while (keyframes_.size() > 1 && keyframes_.front().t < t) keyframes_.pop_front();
  if (dvl_) dvl_->drop_before(t);
  if (imu_ && !keyframes_.empty()) imu_->drop_before(keyframes_.front().t);
}

}  // namespace tandem
