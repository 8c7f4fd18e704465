#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/simulation/dive_motion.hpp>
#include <tandem/studies/simulation/dive_target.hpp>
#include <tandem/studies/simulation/normal_noise.hpp>
#include <tandem/studies/simulation/simulate_dive.hpp>

namespace tandem {
namespace {

constexpr double kAtSurface = 0.5;  // m: GPS works at smaller depths, where the antenna is above the water

// Steps of DiveMotion between two readings, and the step of the first reading. Sensors are not synchronised.
constexpr std::size_t kDvlEvery = 20, kDvlFirst = 7, kDepthEvery = 10, kDepthFirst = 3, kHeadingEvery = 50,
                      kHeadingFirst = 0, kGpsEvery = 100, kGpsFirst = 11, kTruthEvery = 10;

/// Noise streams.
struct Stream {
  enum Of : std::uint32_t {
    accelerometer,
    gyroscope,
    accelerometer_bias,
    gyroscope_bias,
    dvl,
    depth,
    heading,
    gps,
    scale
  };
};

void check_options(const DiveOptions& options) {
  if (!(options.minutes >= 1 && options.minutes <= 600))
    throw Error(fmt::format("minutes must be 1 to 600 for a dive, not {:g}", options.minutes));
  if (!(std::abs(options.latitude) <= 90))
    throw Error(fmt::format("latitude must be -90 to 90 degrees, not {:g}", options.latitude));
  if (!(options.keyframe_interval > kSameInstant))
    throw Error(fmt::format("keyframe_interval must be above 0.001 s, not {:g} s", options.keyframe_interval));
  if (options.surfacings < 0 || 60 * options.minutes < 300 * (options.surfacings + (options.surfacings > 0)))
    throw Error(fmt::format("{} surfacings need {} minutes or more, not {:g}", options.surfacings,
                            5 * (options.surfacings + 1), options.minutes));
  if (!(options.dvl_outage >= 0 && options.dvl_outage < options.dvl_outage_period))
    throw Error(fmt::format("dvl_outage must be 0 s or more and less than dvl_outage_period ({:g} s), not {:g} s",
                            options.dvl_outage_period, options.dvl_outage));
  if (options.dvl_outage > 0 && options.dvl_outage_period / 2 + options.dvl_outage > 60 * options.minutes)
    throw Error(fmt::format("the first dvl_outage, {:g} to {:g} s, exceeds the duration of {:g} minutes",
                            options.dvl_outage_period / 2, options.dvl_outage_period / 2 + options.dvl_outage,
                            options.minutes));
}

/// One of the vehicle's sensors: its description for the estimator, and its simulation.
struct Instrument {
  EgoSensor sensor;
  std::size_t every, first;  // steps
  NormalNoise noise;
  Vector<3> white;          // σ of each reading
  bool at_surface = false;  // works only at the surface
  double scale_error = 0;
};

EgoSensor sensor(EgoSensorType type, const Eigen::VectorXd& sigma, const Vector<3>& position = Vector<3>::Zero()) {
  return {.name = std::string(name(type)), .type = type, .sigma = sigma, .mount = SE3(SO3(), position)};
}

class Simulation {
 public:
  explicit Simulation(const DiveOptions& options)
      : options_(options),
        sensors_(DiveSensors::of(options.grade)),
        motion_(60 * options.minutes, options.surfacings) {}

  SimulatedDive run() {
    prepare();
    for (std::size_t k = 0; k < motion_.size(); ++k) {
      const Motion m = motion_.at(k);
      const double t = motion_.time(k);
      read_imu(t, m);
      for (Instrument& instrument : instruments_)
        if (k % instrument.every == instrument.first && !(instrument.at_surface && m.depth >= kAtSurface))
          read(instrument, t, m);
      if (k % kTruthEvery == 0) {
        dive_.truth.push_back({t, m.state});
        dive_.biases.push_back({t, bias_});
      }
    }
    for (Instrument& instrument : instruments_) dive_.data.sensors.push_back(std::move(instrument.sensor));
    if (options_.target) add_dive_target(options_, dive_);
    return std::move(dive_);
  }

 private:
  void prepare() {
    NavigationData& data = dive_.data;
    const double latitude = options_.latitude * std::numbers::pi / 180;
    data.earth = Earth::at_latitude(latitude, Earth::normal_gravity(latitude));
    data.keyframe_interval = options_.keyframe_interval;
    ImuSensor& imu = data.imu.emplace();
    imu.mount = SE3(SO3::Exp({0, 0, 0.5 * std::numbers::pi}), Vector<3>(0.25, -0.05, 0.12));
    imu.noise = sensors_.imu;
    imu.initial_accelerometer_bias = sensors_.initial_accelerometer_bias;
    imu.initial_gyroscope_bias = sensors_.initial_gyroscope_bias;
    imu.samples.reserve(motion_.size());
    bias_.head<3>() = noise(accelerometer_bias_noise_, Vector<3>::Constant(sensors_.initial_accelerometer_bias));
    bias_.tail<3>() = noise(gyroscope_bias_noise_, Vector<3>::Constant(sensors_.initial_gyroscope_bias));
    const double outage = options_.dvl_outage, period = options_.dvl_outage_period;
    for (double t = period / 2; outage > 0 && t + outage <= 60 * options_.minutes; t += period)
      dive_.dvl_outages.emplace_back(t, t + outage);

    NormalNoise scale(options_.seed, Stream::scale);
    if (options_.noise && options_.dvl_scale) dive_.dvl_scale_error = sensors_.dvl_scale * scale();
    // The DVL's stated σ along x covers its scale factor error at cruise speed.
    const double along = options_.dvl_scale ? std::hypot(sensors_.dvl, 1.5 * sensors_.dvl_scale) : sensors_.dvl;
    const Vector<3> orientation(sensors_.roll_pitch, sensors_.roll_pitch, sensors_.heading);
    const Vector<3> fix(sensors_.gps, sensors_.gps, sensors_.gps_height);
    const auto stream = [&](Stream::Of s) { return NormalNoise(options_.seed, s); };
    instruments_ = {
        {sensor(EgoSensorType::dvl, Vector<3>(along, sensors_.dvl, sensors_.dvl)), kDvlEvery, kDvlFirst,
         stream(Stream::dvl), Vector<3>::Constant(sensors_.dvl), false, dive_.dvl_scale_error},
        {sensor(EgoSensorType::depth, Eigen::VectorXd::Constant(1, sensors_.depth), {-0.4, 0, 0.05}), kDepthEvery,
         kDepthFirst, stream(Stream::depth), Vector<3>(0, 0, sensors_.depth)},
        {sensor(EgoSensorType::heading, orientation), kHeadingEvery, kHeadingFirst, stream(Stream::heading),
         orientation},
        {sensor(EgoSensorType::gps, fix, {-0.1, 0, 0.4}), kGpsEvery, kGpsFirst, stream(Stream::gps), fix, true},
    };
  }

  void read(Instrument& instrument, double t, const Motion& m) {
    EgoSensor& sensor = instrument.sensor;
    const SE3 pose(m.state.rotation(), m.state.translation());
    EgoMeasurement reading = sensor.type->ideal(sensor, t, pose, m.state.velocity());
    const Vector<3> error = noise(instrument.noise, instrument.white);
    if (sensor.type->reading == EgoReading::orientation)
      reading.rotation = reading.rotation * SO3::Exp(error);
    else
      reading.value = (1 + instrument.scale_error) * reading.value + error;
    if (sensor.type == EgoSensorType::dvl && in_dvl_outage(t)) return;
    sensor.measurements.push_back(reading);
  }

  bool in_dvl_outage(double t) const {
    return std::any_of(dive_.dvl_outages.begin(), dive_.dvl_outages.end(),
                       [&](const auto& outage) { return t >= outage.first && t < outage.second; });
  }

  Vector<3> noise(NormalNoise& source, const Vector<3>& sigma) const {
    return options_.noise ? source.vector<3>(sigma) : Vector<3>::Zero();
  }

  void read_imu(double t, const Motion& m) {
    const ImuSensor& imu = *dive_.data.imu;
    const Earth& earth = dive_.data.earth;
    const SO3 to_body = m.state.rotation().inverse(), to_sensor = imu.mount.rotation().inverse();
    const Vector<3> l = imu.mount.translation(), turning = to_body.act(earth.rate), lever = m.rate.cross(l);
    const Vector<3> force = to_body.act(m.acceleration + 2 * earth.rate.cross(m.state.velocity()) - earth.gravity) +
                            m.angular_acceleration.cross(l) + m.rate.cross(lever) + 2 * turning.cross(lever);

    const double root = std::sqrt(DiveMotion::step);
    ImuSample sample{t, to_sensor.act(force) + bias_.head<3>(), to_sensor.act(m.rate + turning) + bias_.tail<3>()};
    sample.specific_force += noise(accelerometer_noise_, Vector<3>::Constant(sensors_.imu.accelerometer / root));
    sample.angular_rate += noise(gyroscope_noise_, Vector<3>::Constant(sensors_.imu.gyroscope / root));
    dive_.data.imu->samples.push_back(sample);
    bias_.head<3>() +=
        noise(accelerometer_bias_noise_, Vector<3>::Constant(sensors_.imu.accelerometer_bias_walk * root));
    bias_.tail<3>() += noise(gyroscope_bias_noise_, Vector<3>::Constant(sensors_.imu.gyroscope_bias_walk * root));
  }

  DiveOptions options_;
  DiveSensors sensors_;
  DiveMotion motion_;
  SimulatedDive dive_;
  std::vector<Instrument> instruments_;
  Vector<6> bias_ = Vector<6>::Zero();
  NormalNoise accelerometer_noise_{options_.seed, Stream::accelerometer},
      gyroscope_noise_{options_.seed, Stream::gyroscope},
      accelerometer_bias_noise_{options_.seed, Stream::accelerometer_bias},
      gyroscope_bias_noise_{options_.seed, Stream::gyroscope_bias};
};

}  // namespace

std::string_view name(Grade grade) { return grade == Grade::mems ? "mems" : "tactical"; }

DiveSensors DiveSensors::of(Grade grade) {
  constexpr double degree = std::numbers::pi / 180;
  DiveSensors s;
  if (grade == Grade::mems) {  // 0.1 mg/√Hz, 0.7 °/√h; 5 mg, 700 °/h at switch-on
    s.imu = {1e-3, 2e-4, 5e-5, 2e-6};
    s.initial_accelerometer_bias = 0.05;
    s.initial_gyroscope_bias = 3.5e-3;
    s.dvl = 0.01;
    s.dvl_scale = 0.005;
    s.depth = 0.05;
    s.roll_pitch = 0.5 * degree;
    s.heading = 1.0 * degree;
  } else {  // 0.03 mg/√Hz, 0.02 °/√h; 1 mg, 1 °/h
    s.imu = {3e-4, 6e-6, 2e-6, 1e-8};
    s.initial_accelerometer_bias = 0.01;
    s.initial_gyroscope_bias = 5e-6;
    s.dvl = 0.004;
    s.dvl_scale = 0.002;
    s.depth = 0.02;
    s.roll_pitch = 0.1 * degree;
    s.heading = 0.5 * degree;
  }
  return s;
}

SimulatedDive simulate_dive(const DiveOptions& options) {
  check_options(options);
  return Simulation(options).run();
}

}  // namespace tandem
