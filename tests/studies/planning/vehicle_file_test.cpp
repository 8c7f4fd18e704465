#include <Eigen/LU>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/planning/vehicle_file.hpp>

#include "studies/scratch.hpp"

namespace tandem {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

const char* const kSmall = R"(name: Small
source: made up
axes: FRD
mass: 10
inertia: [0.2, 0.3, 0.4]
centre_of_mass: [0.1, 0.02, 0.03]
centre_of_buoyancy: [0, 0, 0]
weight: 98.1
buoyancy: 99
added_mass: [1, 2, 3, 0.1, 0.2, 0.3]
linear_damping: [5, 6, 7, 0.5, 0.6, 0.7]
actuators:
  push: {position: [-0.5, 0.1, 0.2], direction: [1, 0, 0], range: [-5, 10], lag: 0.3}
  rudder: {fin: [0, 9, 0, 0, 0, -6], range: [-0.2, 0.2]}
most_twist: [2, 1, 1, 1, 1, 1]
)";

/// Returns the error message for a vehicle file with this text, from the file name on; empty if the file is accepted.
std::string rejection(const std::string& text) {
  const ScratchFolder scratch;
  scratch.write("vehicle.yaml", text);
  try {
    read_vehicle((scratch.path() / "vehicle.yaml").string());
  } catch (const Error& error) {
    const std::string what = error.what();
    return what.substr(what.find("vehicle.yaml"));
  }
  return "";
}

/// Returns kSmall with `from` replaced by `to`.
std::string with(const std::string& from, const std::string& to) {
  std::string text = kSmall;
  return text.replace(text.find(from), from.size(), to);
}

TEST(ReadVehicle, ConvertsForwardRightDownToForwardLeftUp) {
  const ScratchFolder scratch;
  scratch.write("vehicle.yaml", kSmall);
  const Vehicle vehicle = read_vehicle((scratch.path() / "vehicle.yaml").string());
  EXPECT_EQ(vehicle.name, "Small");
  EXPECT_THAT(vehicle.actuators, ElementsAre("push", "rudder"));
  const auto& model = std::get<VehicleModel<3>>(vehicle.model);
  EXPECT_EQ(model.centre_of_mass, Vector<3>(0.1, -0.02, -0.03));
  EXPECT_TRUE(model.mass.diagonal().isApprox((Vector<6>() << 11, 12, 13, 0.3, 0.5, 0.7).finished(), 1e-15));
  EXPECT_DOUBLE_EQ(model.mass(0, 4), 10 * -0.03);  // m z; z changes its sign between FRD and FLU
  EXPECT_DOUBLE_EQ(model.mass(1, 5), 10 * 0.1);
  EXPECT_EQ(model.mass, model.mass.transpose());
  EXPECT_EQ(model.linear(4, 4), 0.6);
  // A forward force 0.1 m right of and 0.2 m below the origin turns the bow to the left and up.
  const Vector<6> push = model.thrust.col(0);
  EXPECT_EQ(push, (Vector<6>() << 1, 0, 0, 0, -0.2, 0.1).finished());
  EXPECT_EQ(model.fin.col(1), (Vector<6>() << 0, -9, 0, 0, 0, 6).finished());
  EXPECT_EQ(model.lower[0], -5.0);
  EXPECT_EQ(model.upper[0], 10.0);
  EXPECT_EQ(model.lag, Vector<3>(0.3, 0.0, 0.0));
  EXPECT_EQ(model.thrust.col(2).norm() + model.fin.col(2).norm(), 0.0);  // idle
}

TEST(ReadVehicle, BuiltInVehiclesAreValid) {
  EXPECT_THAT(builtin_vehicles(), ElementsAre("bluerov2_heavy", "remus_100"));
  for (const std::string& name : builtin_vehicles()) {
    const Vehicle vehicle = read_vehicle(name);
    EXPECT_FALSE(vehicle.source.empty());
    std::visit([](const auto& model) { EXPECT_EQ(why_invalid(model), ""); }, vehicle.model);
  }
  const auto remus = std::get<VehicleModel<3>>(read_vehicle("remus_100").model);
  // A thrust of 3.86 N maintains 1.54 m/s (Prestero 2001).
  EXPECT_NEAR(remus.quadratic(0, 0) * 1.54 * 1.54, 3.86, 0.03);
  const Vector<6> drag(1.62, 1310.0, 131.0, 0.13, 188.0, 94.0);  // Prestero 2001, tables C.1 to C.3
  EXPECT_TRUE(remus.quadratic.diagonal().isApprox(drag)) << remus.quadratic.diagonal().transpose();
  EXPECT_DOUBLE_EQ(remus.lift(5, 1), -10.57);  // the hull's lift turns the bow into the flow
  const auto rov = std::get<VehicleModel<8>>(read_vehicle("bluerov2_heavy").model);
  // All six axes are actuated. Equal vertical thrusts sum to a pure upward force, because the layout is symmetric.
  EXPECT_EQ(Eigen::FullPivLU<Eigen::MatrixXd>(rov.thrust).rank(), 6);
  EXPECT_LE((rov.thrust.rightCols<4>().rowwise().sum() - 4.0 * Vector<6>::Unit(2)).norm(), 1e-12);
}

TEST(ReadVehicle, ErrorsNameFileLineAndKey) {
  EXPECT_EQ(rejection(kSmall), "");
  EXPECT_THAT(rejection(with("added_mass: [1, 2", "added_mass: [-20, 2")),
              HasSubstr("the mass matrix is not positive definite"));
  EXPECT_THAT(rejection(with("linear_damping: [5,", "linear_damping: [-5,")),
              HasSubstr("the linear damping matrix is not positive semidefinite"));
  EXPECT_THAT(rejection(with("linear_damping: [5, 6, 7, 0.5, 0.6, 0.7]", "linear_damping: [0, 0, 0, 0, 0, 0]")),
              HasSubstr("the damping matrix is not positive definite"));
  EXPECT_THAT(rejection(with("added_mass: [1, 2, 3, 0.1, 0.2, 0.3]", "added_mass: [1, 2, 3]")),
              HasSubstr("vehicle.yaml:10: added_mass needs 6 numbers (diagonal) or 36"));
  EXPECT_THAT(rejection(with("axes: FRD", "axes: NED")),
              HasSubstr("vehicle.yaml:3: axes must be FLU or FRD, not 'NED'"));
  EXPECT_THAT(rejection(with("buoyancy: 99", "boyancy: 99")), HasSubstr("vehicle.yaml:9: unknown key 'boyancy'"));
  EXPECT_THAT(rejection(with("range: [-5, 10]", "range: [5, -10]")), HasSubstr("range needs the minimum command"));
  EXPECT_THAT(rejection(with("lag: 0.3", "lag: -1")), HasSubstr("lag must not be negative"));
  EXPECT_THAT(rejection(with("lag: 0.3", "lag: 1e308")), HasSubstr("lag: 1e+308 is out of range"));
  EXPECT_THAT(rejection(with("buoyancy: 99", "buoyancy: -1e200")), HasSubstr("vehicle.yaml:9: buoyancy: -1e+200 is"));
  EXPECT_THAT(rejection(with("lag: 0.3", "lagg: 1")), HasSubstr("unknown key 'lagg' in actuators push"));
  EXPECT_THAT(rejection(with("direction: [1, 0, 0]", "direction: [0, 0, 0]")), HasSubstr("an actuator needs"));
  EXPECT_THROW(read_vehicle("remus_10"), Error);
}

}  // namespace
}  // namespace tandem
