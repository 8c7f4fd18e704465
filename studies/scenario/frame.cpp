#include <cmath>

#include <tandem/studies/scenario/frame.hpp>

namespace tandem {
namespace {

/// Half a turn about the bisector of north and east: NED to ENU.
SO3 world_turn() { return SO3(SO3::Quaternion(0.0, std::sqrt(0.5), std::sqrt(0.5), 0.0)); }
/// Half a turn about the forward axis: FRD to FLU.
SO3 body_turn() { return SO3(SO3::Quaternion(0.0, 1.0, 0.0, 0.0)); }

}  // namespace

Frame Frame::ned_frd() {
  Frame frame;
  frame.ned_ = true;
  return frame;
}

Vector<3> Frame::world(const Vector<3>& p) const { return ned_ ? Vector<3>(p.y(), p.x(), -p.z()) : p; }
Vector<3> Frame::body(const Vector<3>& p) const { return ned_ ? Vector<3>(p.x(), -p.y(), -p.z()) : p; }

SO3 Frame::world(const SO3& R) const { return ned_ ? world_turn() * R * body_turn() : R; }
SE3 Frame::world(const SE3& pose) const { return SE3(world(pose.rotation()), world(pose.translation())); }

SO3 Frame::body(const SO3& R) const { return ned_ ? body_turn() * R * body_turn() : R; }
SE3 Frame::body(const SE3& pose) const { return SE3(body(pose.rotation()), body(pose.translation())); }

Matrix<3, 3> Frame::world_axes() const {
  return ned_ ? Matrix<3, 3>{{0, 1, 0}, {1, 0, 0}, {0, 0, -1}} : Matrix<3, 3>::Identity();
}
Matrix<3, 3> Frame::body_axes() const { return body(Vector<3>(1, 1, 1)).asDiagonal(); }

}  // namespace tandem
