#include <memory>
#include <utility>

#include <tandem/lie/error.hpp>
#include <tandem/problem/navigation/systematic_error_checks.hpp>
#include <tandem/problem/residual_array.hpp>
#include <tandem/problem/tracking/sensor_build.hpp>
#include <tandem/problem/tracking/tracking_build.hpp>
#include <tandem/residuals/gauss_markov.hpp>
#include <tandem/residuals/prior.hpp>

namespace tandem::detail {
namespace {

template <LieGroup G>
void place_by_type(TrackingBuild<G>& build, const Placing& at) {
  const TargetSensor& sensor = build.data.sensors[at.sensor];
  const auto place = sensor.type->place.of<G>();
  if (!place)
    throw BadInputError(sensor.name + ": planar problems do not support sensors of type " +
                        std::string(name(sensor.type)));
  if (sensor.error)
    if (const std::string why = why_invalid(*sensor.error); !why.empty())
      throw BadInputError(error_name(sensor.name) + ": " + why);
  place(build, at);
}

}  // namespace

std::function<Problem::Linearization(const Problem&)> innovation_of(const ResidualFunctions& functions,
                                                                    const void* residual,
                                                                    std::vector<int> variable_ids) {
  const auto copy = std::make_shared<ResidualArray>(functions);
  copy->add(residual);
  return [&functions, copy, ids = std::move(variable_ids)](const Problem& problem) {
    return problem.linearization(functions, (*copy)[0], ids);
  };
}

template <LieGroup G>
void TrackingBuild<G>::add_measurement(std::size_t sensor, std::size_t i, std::size_t k) {
  place_by_type(*this, {sensor, i, k});
}

template <LieGroup G>
void TrackingBuild<G>::add_measurement_after(std::size_t sensor, std::size_t i, std::size_t k) {
  const double t = data.sensors[sensor].valid_at(data.sensors[sensor].measurements[i]);
  place_by_type(*this, {sensor, i, k, (t - out.keyframes[k].t) / dt(k, k + 1)});
}

template <LieGroup G>
template <int N>
void TrackingBuild<G>::add_bias(std::size_t sensor, double t) {
  constexpr double kMinStep = 1e-6;  // relative to the standard deviation of the bias
  const SystematicError& error = *data.sensors[sensor].error;
  const std::string entry = error_name(data.sensors[sensor].name);
  const Gaussian noise = noise_of(entry, error.bias_sigma, N);
  const auto last = biases.find(sensor);
  if (last == biases.end()) {
    const auto first = problem.add(Rn<N>(), entry);
    minimize(Prior<Rn<N>>{Rn<N>()}, entry, noise, {first});
    biases.insert({sensor, {t, first}});
    if (error.has_constant_bias()) constants.add_bias(data.sensors[sensor].name, first, error.bias_sigma);
    return;
  }
  const auto step = GaussMarkov<N>::after(std::abs(t - last->second.t), error.correlation_time);
  if (!(step.noise_scale() > kMinStep)) return;
  const auto before = std::get<Variable<Rn<N>>>(last->second.state);
  const auto next = problem.add(step.expected(problem.value(before)), entry);
  minimize(step, entry, noise.scaled(step.noise_scale()), {before, next});
  last->second = {t, next};
}

template <LieGroup G>
const typename TrackingBuild<G>::SensorBias& TrackingBuild<G>::bias_at(std::size_t sensor, double t) {
  switch (rows(data.sensors[sensor].type, planar)) {
    case 1:
      add_bias<1>(sensor, t);
      break;
    case 2:
      add_bias<2>(sensor, t);
      break;
    case 3:
      add_bias<3>(sensor, t);
      break;
    default:
      add_bias<6>(sensor, t);
  }
  return biases.at(sensor);
}

template const TrackingBuild<SE3>::SensorBias& TrackingBuild<SE3>::bias_at(std::size_t, double);
template const TrackingBuild<SE2>::SensorBias& TrackingBuild<SE2>::bias_at(std::size_t, double);
template void TrackingBuild<SE3>::add_measurement(std::size_t, std::size_t, std::size_t);
template void TrackingBuild<SE2>::add_measurement(std::size_t, std::size_t, std::size_t);
template void TrackingBuild<SE3>::add_measurement_after(std::size_t, std::size_t, std::size_t);
template void TrackingBuild<SE2>::add_measurement_after(std::size_t, std::size_t, std::size_t);

}  // namespace tandem::detail
