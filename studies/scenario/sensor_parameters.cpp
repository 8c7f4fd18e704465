#include <cmath>

#include <fmt/format.h>

#include <tandem/studies/scenario/sensor_parameters.hpp>
#include <tandem/studies/support/option_values.hpp>

namespace tandem {
namespace {

/// Returns the correlation time of the bias of a sensor.
SensorParameter time_of(const std::string& sensor, std::optional<SystematicError>& error) {
  SensorParameter parameter{sensor + ".time", 0, "", error && error->has_bias() && !error->has_constant_bias(),
                            [&error](double time) { error->correlation_time = time; }};
  if (!parameter.settable)
    parameter.why_not = fmt::format("{} has no bias with a correlation time; add one with --error {}=SIGMA,...:SECONDS",
                                    sensor, sensor);
  else
    parameter.value = error->correlation_time;
  return parameter;
}

/// Returns the degrees of freedom of the Student's t loss of a sensor. `default_loss` applies if the sensor has no
/// loss.
SensorParameter dof_of(const std::string& sensor, std::optional<Loss>& loss, const Loss& default_loss, int rows) {
  SensorParameter parameter{sensor + ".dof", 0, "", true, [&loss, rows](double dof) { loss = StudentT(dof, rows); }};
  const Loss now = loss.value_or(default_loss);
  const double dof = now.scale * now.scale - rows;  // see StudentT()
  if (now.kind == Loss::Kind::none)
    parameter.why_not = fmt::format("{} has no student-t loss; set one with --loss {}=student-t:3", sensor, sensor);
  else if (now.kind != Loss::Kind::student_t)
    parameter.why_not = fmt::format("the loss {} of {} has no degrees of freedom; use --loss {}=student-t:3",
                                    loss_text(now), sensor, sensor);
  else if (!(dof > 0))
    parameter.why_not =
        fmt::format("student-t:{:g} of {} is an improper density; with {} rows, its scale must be above {:.3g}",
                    now.scale, sensor, rows, std::sqrt(rows));
  else
    parameter.value = dof;
  return parameter;
}

}  // namespace

std::vector<SensorParameter> sensor_parameters(Scenario& scenario, const SensorLosses& losses) {
  std::vector<SensorParameter> parameters;
  const bool planar = scenario.data.planar;
  for (TargetSensor& sensor : scenario.data.sensors) {
    parameters.push_back(time_of(sensor.name, sensor.error));
    const bool pose = sensor.type->has(measured::rotation);
    const bool position_alone = pose && (losses.separate_orientation || sensor.orientation_loss);
    const int rows = position_alone ? (planar ? 2 : 3) : tandem::rows(sensor.type, planar);
    SensorParameter& dof = parameters.emplace_back(dof_of(sensor.name, sensor.loss, losses.target, rows));
    if (pose && losses.split_poses && dof.why_not.empty())
      dof.why_not = fmt::format(
          "the positions and orientations of {} have separate residuals (--robust, or a target without orientation), "
          "so its loss has no single number of degrees of freedom",
          sensor.name);
  }
  if (scenario.navigation)
    for (EgoSensor& sensor : scenario.navigation->sensors) {
      parameters.push_back(time_of(sensor.name, sensor.error));
      parameters.push_back(dof_of(sensor.name, sensor.loss, losses.own, tandem::rows(sensor.type)));
    }
  return parameters;
}

}  // namespace tandem
