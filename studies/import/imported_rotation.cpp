#include <cmath>

#include <Eigen/Geometry>

#include <tandem/studies/import/imported_rotation.hpp>

namespace tandem {
namespace {

using Matrix3 = Eigen::Matrix3d;

constexpr double kNormTolerance = 0.05;

Matrix3 matrix(const AxisMap& map) {
  Matrix3 M = Matrix3::Zero();
  for (int i = 0; i < 3; ++i) M(i, map.from[static_cast<std::size_t>(i)]) = map.sign[static_cast<std::size_t>(i)];
  return M;
}

Matrix3 about(char axis, double angle) {
  return Eigen::AngleAxisd(angle, Eigen::Vector3d::Unit(axis - 'x')).toRotationMatrix();
}

/// Returns the orientation of a level body in the recording's axes, from its heading.
Matrix3 by_heading(double heading, const ImportAxes& axes) {
  return matrix(axis_map("NED", axes.world)) * about('z', heading) * matrix(axis_map("FRD", axes.body)).transpose();
}

std::array<double, 4> coefficients(Eigen::Quaterniond q) {
  q.normalize();
  if (q.w() < 0) q.coeffs() = -q.coeffs();
  return {q.x(), q.y(), q.z(), q.w()};
}

}  // namespace

double* RotationInput::find(const std::string& quantity) {
  if (quantity == "roll") return &roll;
  if (quantity == "pitch") return &pitch;
  if (quantity == "yaw") return &yaw;
  if (quantity == "quaternion_xyzw") return way = Way::xyzw, xyzw;
  if (quantity == "quaternion_wxyz") return way = Way::wxyz, wxyz;
  if (quantity == "heading") return way = Way::heading, &heading;
  if (quantity == "euler") return way = Way::euler, euler;
  if (quantity == "magnetic_field") return way = Way::magnetic_field, magnetic_field;
  return nullptr;
}

double RotationInput::norm() const {
  const double* q = way == Way::wxyz ? wxyz : xyzw;
  return std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
}

std::optional<std::array<double, 4>> rotation_of(const RotationInput& input, const ImportAxes& axes,
                                                 const AxisMap& world, const AxisMap& body) {
  using enum RotationInput::Way;
  const Matrix3 tilt = about('y', input.pitch) * about('x', input.roll);
  Matrix3 R = Matrix3::Identity();
  switch (input.way) {
    case angles:
      R = about('z', input.yaw) * tilt;
      break;
    case heading:
      R = by_heading(input.heading, axes) * tilt;
      break;
    case euler:
      for (std::size_t i = 0; i < 3; ++i) R = R * about(input.euler_order[i], input.euler[i]);
      break;
    case magnetic_field: {
      const double* m = input.magnetic_field;
      const auto frd = axis_map(axes.body, "FRD").apply({m[0], m[1], m[2]});
      R = by_heading(std::atan2(-frd[1], frd[0]), axes) * tilt;
      break;
    }
    case xyzw:
    case wxyz: {
      if (!(std::abs(input.norm() - 1) < kNormTolerance)) return {};
      const double* q = input.way == wxyz ? input.wxyz : input.xyzw;
      const int w = input.way == wxyz ? 0 : 3, x = input.way == wxyz ? 1 : 0;
      R = Eigen::Quaterniond(q[w], q[x], q[x + 1], q[x + 2]).normalized().toRotationMatrix();
      break;
    }
  }
  const Matrix3 turned = matrix(world) * R * matrix(body).transpose();
  return coefficients(Eigen::Quaterniond(turned));
}

std::array<double, 4> turned_clockwise(const std::array<double, 4>& xyzw, double angle, bool ned) {
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(ned ? angle : -angle, Eigen::Vector3d::UnitZ()));
  return coefficients(turn * Eigen::Quaterniond(xyzw[3], xyzw[0], xyzw[1], xyzw[2]));
}

}  // namespace tandem
