#include <cmath>

#include <fmt/format.h>

#include <tandem/studies/scenario/sensor_numbers.hpp>
#include <tandem/studies/support/option_values.hpp>

namespace tandem {
namespace {

SensorNumber time_of(const std::string& sensor, std::optional<StayingError>& error) {
  SensorNumber number{sensor + ".time", 0, "", error && error->has_bias() && !error->has_constant_bias(),
                      [&error](double time) { error->time = time; }};
  if (!number.settable)
    number.why_not =
        fmt::format("{} has no error that is forgotten: give it one, by --error {}=SIGMA,...:SECONDS", sensor, sensor);
  else
    number.value = error->time;
  return number;
}

SensorNumber dof_of(const std::string& sensor, std::optional<Loss>& loss, const Loss& otherwise, int rows) {
  SensorNumber number{sensor + ".dof", 0, "", true, [&loss, rows](double dof) { loss = StudentT(dof, rows); }};
  const Loss now = loss.value_or(otherwise);
  const double dof = now.scale * now.scale - rows;  // see StudentT()
  if (now.kind == Loss::Kind::none)
    number.why_not =
        fmt::format("{} has no loss with degrees of freedom: give it one, by --loss {}=student-t:3", sensor, sensor);
  else if (now.kind != Loss::Kind::student_t)
    number.why_not = fmt::format(
        "the loss of {}, {}, stands for normal noise but for outliers, and has no tails that the evidence could tell: "
        "--loss {}=student-t:3 has",
        sensor, loss_text(now), sensor);
  else if (!(dof > 0))
    number.why_not = fmt::format("student-t:{:g} of {} is no density: the scale of {} rows has to be above {:.3g}",
                                 now.scale, sensor, rows, std::sqrt(rows));
  else
    number.value = dof;
  return number;
}

}  // namespace

std::vector<SensorNumber> sensor_numbers(Scenario& scenario, const SensorLosses& losses) {
  std::vector<SensorNumber> numbers;
  const bool planar = scenario.data.planar;
  for (TargetSensor& sensor : scenario.data.sensors) {
    numbers.push_back(time_of(sensor.name, sensor.error));
    const bool pose = sensor.type->has(measured::rotation);
    const bool position_alone = pose && (losses.orientation_apart || sensor.orientation_loss);
    const int rows = position_alone ? (planar ? 2 : 3) : tandem::rows(sensor.type, planar);
    SensorNumber& dof = numbers.emplace_back(dof_of(sensor.name, sensor.loss, losses.target, rows));
    if (pose && losses.by_parts && dof.why_not.empty())
      dof.why_not = fmt::format(
          "poses of {} count by parts, by --robust or where the target is a point, under one loss of as many rows",
          sensor.name);
  }
  if (scenario.navigation)
    for (EgoSensor& sensor : scenario.navigation->sensors) {
      numbers.push_back(time_of(sensor.name, sensor.error));
      numbers.push_back(dof_of(sensor.name, sensor.loss, losses.own, tandem::rows(sensor.type)));
    }
  return numbers;
}

}  // namespace tandem
