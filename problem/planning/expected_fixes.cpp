#include <tandem/lie/error.hpp>
#include <tandem/problem/planning/expected_fixes.hpp>

namespace tandem {

std::vector<Matrix<6, 6>> expected_fixes(const std::vector<ExpectedSensor>& sensors, double dt,
                                         const std::vector<SE3>& chaser, const std::vector<SE3>& target) {
  if (chaser.empty() || chaser.size() != target.size())
    throw BadInputError("expected_fixes: chaser and target must have the same number of poses, at least one");
  std::vector<Matrix<6, 6>> fixes;
  for (std::size_t k = 1; k < chaser.size(); ++k) {
    Matrix<6, 6> information = Matrix<6, 6>::Zero();
    const Matrix<3, 3> to_chaser = (chaser[k].rotation().inverse() * target[k].rotation()).matrix();
    for (const ExpectedSensor& sensor : sensors) {
      double fixes_in_step = sensor.rate * dt;
      if (sensor.sight)
        fixes_in_step *= Visibility{*sensor.sight}.probability(
            in_sensor_frame(chaser[k], target[k], sensor.sight->B, sensor.sight->beacon));
      const Vector<3> position = fixes_in_step * sensor.position.cwiseAbs2().cwiseInverse();
      if (sensor.rotation) {
        information.diagonal().head<3>() += position;
        information.diagonal().tail<3>() += fixes_in_step * sensor.rotation->cwiseAbs2().cwiseInverse();
      } else {
        information.topLeftCorner<3, 3>() += to_chaser.transpose() * position.asDiagonal() * to_chaser;
      }
    }
    fixes.push_back(information);
  }
  return fixes;
}

}  // namespace tandem
