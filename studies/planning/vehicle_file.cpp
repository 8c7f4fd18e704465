#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/lie/so3.hpp>
#include <tandem/studies/planning/vehicle_file.hpp>
#include <tandem/studies/scenario/yaml_section.hpp>
#include <tandem/studies/support/installation.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

constexpr int kMaxActuators = 8;
constexpr double kMaxMagnitude = 1e15;  // limit in any unit: exceeds any real vehicle, and its powers do not overflow

/// Converts vectors, twists, wrenches and the matrices between them from the axes of a file to FLU.
struct Axes {
  bool down;  // the file is in FRD

  Vector<3> to_flu(const std::vector<double>& v) const {
    const double sign = down ? -1.0 : 1.0;
    return {v[0], sign * v[1], sign * v[2]};
  }
  Vector<6> signs() const {
    const double s = down ? -1.0 : 1.0;
    return (Vector<6>() << 1.0, s, s, 1.0, s, s).finished();
  }
  Vector<6> to_flu6(const std::vector<double>& v) const {
    return signs().cwiseProduct(Eigen::Map<const Vector<6>>(v.data()));
  }
  Matrix<6, 6> to_flu(const Matrix<6, 6>& M) const { return signs().asDiagonal() * M * signs().asDiagonal(); }
};

/// Rejects numbers so large that the violations of a plan would not be finite.
void check_sizes(const YamlSection& yaml, const std::vector<std::string>& keys) {
  for (const std::string& key : keys) {
    if (!yaml.has(key)) continue;
    for (const double x : yaml.numbers(key))
      if (!(std::abs(x) <= kMaxMagnitude))
        yaml.fail(key, fmt::format("{}: {:g} is out of range; its magnitude is at most {:g}", key, x, kMaxMagnitude));
  }
}

Matrix<6, 6> matrix(const YamlSection& yaml, const std::string& key, const Axes& axes) {
  if (!yaml.has(key)) return Matrix<6, 6>::Zero();
  const std::vector<double> v = yaml.numbers(key);
  if (v.size() == 6) return Eigen::Map<const Vector<6>>(v.data()).asDiagonal();
  if (v.size() != 36)
    yaml.fail(key, fmt::format("{} needs 6 numbers (diagonal) or 36 (row by row), not {}", key, v.size()));
  return axes.to_flu(Matrix<6, 6>(Eigen::Map<const Matrix<6, 6>>(v.data()).transpose()));
}

/// Returns the rigid-body mass matrix [m I, −m [r]×; m [r]×, I_o]; the inertia I_o is about the origin.
Matrix<6, 6> rigid_body(const YamlSection& yaml, const Vector<3>& centre, const Axes& axes) {
  const double m = yaml.number("mass");
  const std::vector<double> I = yaml.numbers("inertia");
  if (I.size() != 3 && I.size() != 6)
    yaml.fail("inertia", fmt::format("inertia needs 3 numbers (xx yy zz) or 6 (xx yy zz xy xz yz), not {}", I.size()));
  Matrix<6, 6> M = Matrix<6, 6>::Zero();
  M.topLeftCorner<3, 3>() = m * Matrix<3, 3>::Identity();
  M.topRightCorner<3, 3>() = -m * skew(centre);
  M.bottomLeftCorner<3, 3>() = m * skew(centre);
  Matrix<6, 6> inertia = Matrix<6, 6>::Zero();
  for (int i = 0; i < 3; ++i) inertia(3 + i, 3 + i) = I[std::size_t(i)];
  if (I.size() == 6) {
    inertia(3, 4) = inertia(4, 3) = I[3];
    inertia(3, 5) = inertia(5, 3) = I[4];
    inertia(4, 5) = inertia(5, 4) = I[5];
  }
  return M + axes.to_flu(inertia);
}

struct Actuator {
  Vector<6> thrust = Vector<6>::Zero(), fin = Vector<6>::Zero();
  double lower, upper, lag;
};

Actuator read_actuator(const YamlSection& yaml, const Axes& axes) {
  yaml.allow_only({"thrust", "fin", "position", "direction", "range", "lag"});
  check_sizes(yaml, {"thrust", "fin", "position", "direction", "range", "lag"});
  Actuator a{};
  if (yaml.has("thrust")) a.thrust = axes.to_flu6(yaml.numbers("thrust", 6));
  if (yaml.has("fin")) a.fin = axes.to_flu6(yaml.numbers("fin", 6));
  if (yaml.has("direction")) {
    const Vector<3> direction = axes.to_flu(yaml.numbers("direction", 3));
    const Vector<3> position = axes.to_flu(yaml.numbers("position", 3));
    a.thrust.head<3>() += direction;
    a.thrust.tail<3>() += position.cross(direction);
  }
  if (!(a.thrust.norm() + a.fin.norm() > 0))
    yaml.fail("an actuator needs a nonzero `thrust`, `direction` (with `position`) or `fin`");
  const std::vector<double> range = yaml.numbers("range", 2);
  if (!(range[0] < range[1])) yaml.fail("range", "range needs the minimum command, then a greater maximum");
  a.lower = range[0];
  a.upper = range[1];
  a.lag = yaml.has("lag") ? yaml.number("lag") : 0.0;
  if (!(a.lag >= 0)) yaml.fail("lag", "lag must not be negative [s]");
  return a;
}

template <int N>
VehicleModel<N> make_model(const VehicleBody& body, const std::vector<Actuator>& actuators) {
  VehicleModel<N> model;
  static_cast<VehicleBody&>(model) = body;
  for (std::size_t i = 0; i < actuators.size(); ++i) {
    const Eigen::Index k = Eigen::Index(i);
    model.thrust.col(k) = actuators[i].thrust;
    model.fin.col(k) = actuators[i].fin;
    model.lower[k] = actuators[i].lower;
    model.upper[k] = actuators[i].upper;
    model.lag[k] = actuators[i].lag;
  }
  return model;
}

std::filesystem::path vehicles_folder() { return share_folder() / "vehicles"; }

std::filesystem::path vehicle_path(const std::string& name_or_file) {
  const std::vector<std::string> names = builtin_vehicles();
  if (std::find(names.begin(), names.end(), name_or_file) != names.end())
    return vehicles_folder() / (name_or_file + ".yaml");
  if (!std::filesystem::exists(name_or_file))
    throw Error(fmt::format("there is no vehicle {}{} (there are: {}; or give a YAML file)", quote(name_or_file),
                            did_you_mean(name_or_file, names), listed(names)));
  return name_or_file;
}

}  // namespace

std::vector<std::string> builtin_vehicles() {
  std::vector<std::string> names;
  std::error_code none;
  for (const auto& entry : std::filesystem::directory_iterator(vehicles_folder(), none))
    if (entry.path().extension() == ".yaml") names.push_back(entry.path().stem().string());
  std::sort(names.begin(), names.end());
  return names;
}

PursuitOptions pursuit_limits(const Vehicle& vehicle) {
  PursuitOptions pursuit;
  pursuit.speed = 0.6 * vehicle.most_twist[0];
  pursuit.turn_rate = 0.7 * vehicle.most_twist[5];
  return pursuit;
}

Vehicle read_vehicle(const std::string& name_or_file) {
  const YamlSection yaml = YamlSection::load(vehicle_path(name_or_file));
  yaml.allow_only({"name", "description", "source", "axes", "origin", "mass", "inertia", "centre_of_mass",
                   "centre_of_buoyancy", "weight", "buoyancy", "added_mass", "linear_damping", "quadratic_damping",
                   "lift", "actuators", "most_twist"});
  const std::string word = yaml.has("axes") ? yaml.text("axes") : "FLU";
  if (word != "FRD" && word != "FLU") yaml.fail("axes", fmt::format("axes must be FLU or FRD, not {}", quote(word)));
  const Axes axes{word == "FRD"};

  check_sizes(yaml, {"mass", "inertia", "centre_of_mass", "centre_of_buoyancy", "weight", "buoyancy", "added_mass",
                     "linear_damping", "quadratic_damping", "lift", "most_twist"});
  VehicleBody body;
  body.centre_of_mass = axes.to_flu(yaml.numbers("centre_of_mass", 3));
  body.centre_of_buoyancy = axes.to_flu(yaml.numbers("centre_of_buoyancy", 3));
  body.weight = yaml.number("weight");
  body.buoyancy = yaml.number("buoyancy");
  body.mass = rigid_body(yaml, body.centre_of_mass, axes) + matrix(yaml, "added_mass", axes);
  body.linear = matrix(yaml, "linear_damping", axes);
  body.quadratic = matrix(yaml, "quadratic_damping", axes);
  body.lift = matrix(yaml, "lift", axes);
  if (const std::string why = why_invalid(body); !why.empty()) yaml.fail(why);

  Vehicle vehicle;
  vehicle.name = yaml.text("name");
  vehicle.description = yaml.has("description") ? yaml.text("description") : "";
  vehicle.source = yaml.text("source");
  const YamlSection section = yaml.section("actuators");
  std::vector<Actuator> actuators;
  for (const std::string& key : section.keys()) {
    vehicle.actuators.push_back(key);
    actuators.push_back(read_actuator(section.section(key), axes));
  }
  if (actuators.empty() || actuators.size() > kMaxActuators)
    yaml.fail("actuators", fmt::format("a vehicle has 1 to {} actuators, not {}", kMaxActuators, actuators.size()));
  if (actuators.size() <= 3) {
    vehicle.model = make_model<3>(body, actuators);
  } else {
    vehicle.model = make_model<8>(body, actuators);
  }
  const std::vector<double> most = yaml.numbers("most_twist", 6);
  vehicle.most_twist = Eigen::Map<const Vector<6>>(most.data());
  if (!(vehicle.most_twist.array() > 0).all()) yaml.fail("most_twist", "most_twist must be above zero on every axis");
  return vehicle;
}

}  // namespace tandem
