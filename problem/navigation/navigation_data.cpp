#include <cmath>

#include <tandem/problem/navigation/ego_placement.hpp>
#include <tandem/problem/navigation/navigation_data.hpp>

namespace tandem {
namespace detail {

// Each function has its source file, e.g. place_dvl.cpp.
Block place_dvl(const EgoPlacing& at, const EgoMeasurement& m);
Block place_depth(const EgoPlacing& at, const EgoMeasurement& m);
Block place_gps(const EgoPlacing& at, const EgoMeasurement& m);
Block place_heading(const EgoPlacing& at, const EgoMeasurement& m);

}  // namespace detail
namespace {

EgoMeasurement ideal_dvl(const EgoSensor&, double t, const SE3& pose, const Vector<3>& velocity) {
  return {t, pose.rotation().inverse().act(velocity)};
}
EgoMeasurement ideal_depth(const EgoSensor& sensor, double t, const SE3& pose, const Vector<3>&) {
  return {t, Vector<3>(0, 0, pose.act(sensor.mount.translation()).z())};
}
EgoMeasurement ideal_gps(const EgoSensor& sensor, double t, const SE3& pose, const Vector<3>&) {
  return {t, pose.act(sensor.mount.translation())};
}
EgoMeasurement ideal_heading(const EgoSensor& sensor, double t, const SE3& pose, const Vector<3>&) {
  return {t, Vector<3>::Zero(), pose.rotation() * sensor.mount.rotation()};
}

constexpr EgoSensorTraits kTable[] = {
    {"dvl", "t,vx,vy,vz", EgoReading::body_vector, EgoMounting::none, 30, "speed over ground", "m/s",
     "too fast for a vehicle; if the file is in mm/s or cm/s, convert it to m/s", false, ideal_dvl, detail::place_dvl},
    {"depth", "t,z", EgoReading::world_height, EgoMounting::position, 11'100, "depth", "m",
     "deeper than any sea; if the file is in mm or is a pressure, convert it to m", true, ideal_depth,
     detail::place_depth},
    {"gps", "t,x,y,z", EgoReading::world_vector, EgoMounting::position, 1e7, "distance from the origin", "m",
     "too far; give x y z in m along the world's axes, from an origin near the vehicle", false, ideal_gps,
     detail::place_gps},
    {"heading", "t,qx,qy,qz,qw", EgoReading::orientation, EgoMounting::orientation, HUGE_VAL, "", "", "", false,
     ideal_heading, detail::place_heading},
};

/// Returns a row of the table. An unknown name is a compile-time error.
consteval const EgoSensorTraits& of(std::string_view name) {
  for (const EgoSensorTraits& traits : kTable)
    if (traits.name == name) return traits;
  throw "no such sensor";
}

}  // namespace

constinit const EgoSensorType EgoSensorType::dvl = of("dvl"), EgoSensorType::depth = of("depth"),
                              EgoSensorType::gps = of("gps"), EgoSensorType::heading = of("heading");

std::span<const EgoSensorTraits> ego_sensor_types() { return kTable; }

}  // namespace tandem
