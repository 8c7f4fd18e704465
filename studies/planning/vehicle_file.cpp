#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/lie/so3.hpp>
#include <tandem/studies/planning/vehicle_file.hpp>
#include <tandem/studies/scenario/yaml_section.hpp>
#include <tandem/studies/support/share_folder.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

constexpr int kMostActuators = 8;
constexpr double kMost = 1e15;  // in any unit: more than a ship has, and its powers do not overflow

/// Between the axes of a file and the project's: a vector, a twist or wrench, and what maps one to another.
struct Axes {
  bool down;  // FRD

  Vector<3> turned(const std::vector<double>& v) const {
    const double sign = down ? -1.0 : 1.0;
    return {v[0], sign * v[1], sign * v[2]};
  }
  Vector<6> signs() const {
    const double s = down ? -1.0 : 1.0;
    return (Vector<6>() << 1.0, s, s, 1.0, s, s).finished();
  }
  Vector<6> turned6(const std::vector<double>& v) const {
    return signs().cwiseProduct(Eigen::Map<const Vector<6>>(v.data()));
  }
  Matrix<6, 6> turned(const Matrix<6, 6>& M) const { return signs().asDiagonal() * M * signs().asDiagonal(); }
};

/// Refuses numbers that no vehicle has: plans would come out of them with violations that are no numbers.
void check_sizes(const YamlSection& yaml, const std::vector<std::string>& keys) {
  for (const std::string& key : keys) {
    if (!yaml.has(key)) continue;
    for (const double x : yaml.numbers(key))
      if (!(std::abs(x) <= kMost)) yaml.fail(key, fmt::format("{}: no vehicle has {:g} of it", key, x));
  }
}

Matrix<6, 6> matrix(const YamlSection& yaml, const std::string& key, const Axes& axes) {
  if (!yaml.has(key)) return Matrix<6, 6>::Zero();
  const std::vector<double> v = yaml.numbers(key);
  if (v.size() == 6) return Eigen::Map<const Vector<6>>(v.data()).asDiagonal();
  if (v.size() != 36)
    yaml.fail(key, fmt::format("{} needs 6 numbers, its diagonal, or 36, row by row, not {}", key, v.size()));
  return axes.turned(Matrix<6, 6>(Eigen::Map<const Matrix<6, 6>>(v.data()).transpose()));
}

/// Of the body alone, its inertia about the origin: [m I, −m [r]×; m [r]×, I].
Matrix<6, 6> rigid_body(const YamlSection& yaml, const Vector<3>& centre, const Axes& axes) {
  const double m = yaml.number("mass");
  const std::vector<double> I = yaml.numbers("inertia");
  if (I.size() != 3 && I.size() != 6)
    yaml.fail("inertia", fmt::format("inertia needs 3 numbers, xx yy zz, or 6, with xy xz yz, not {}", I.size()));
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
  return M + axes.turned(inertia);
}

struct Actuator {
  Vector<6> thrust = Vector<6>::Zero(), fin = Vector<6>::Zero();
  double lower, upper, lag;
};

Actuator read_actuator(const YamlSection& yaml, const Axes& axes) {
  yaml.allow_only({"thrust", "fin", "position", "direction", "range", "lag"});
  check_sizes(yaml, {"thrust", "fin", "position", "direction", "range", "lag"});
  Actuator a{};
  if (yaml.has("thrust")) a.thrust = axes.turned6(yaml.numbers("thrust", 6));
  if (yaml.has("fin")) a.fin = axes.turned6(yaml.numbers("fin", 6));
  if (yaml.has("direction")) {
    const Vector<3> direction = axes.turned(yaml.numbers("direction", 3));
    const Vector<3> position = axes.turned(yaml.numbers("position", 3));
    a.thrust.head<3>() += direction;
    a.thrust.tail<3>() += position.cross(direction);
  }
  if (!(a.thrust.norm() + a.fin.norm() > 0))
    yaml.fail("an actuator pushes by `thrust`, by `position` and `direction`, or by `fin`");
  const std::vector<double> range = yaml.numbers("range", 2);
  if (!(range[0] < range[1])) yaml.fail("range", "range is from the least to the greatest command, the first below");
  a.lower = range[0];
  a.upper = range[1];
  a.lag = yaml.has("lag") ? yaml.number("lag") : 0.0;
  if (!(a.lag >= 0)) yaml.fail("lag", "lag must not be negative [s]");
  return a;
}

template <int N>
VehicleModel<N> assembled(const VehicleBody& body, const std::vector<Actuator>& actuators) {
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

std::filesystem::path file_of(const std::string& name_or_file) {
  const std::vector<std::string> names = builtin_vehicles();
  if (std::find(names.begin(), names.end(), name_or_file) != names.end())
    return vehicles_folder() / (name_or_file + ".yaml");
  if (!std::filesystem::exists(name_or_file))
    throw Error(fmt::format("there is no vehicle {}{} (there are: {}, or a yaml file)", quote(name_or_file),
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

Vehicle read_vehicle(const std::string& name_or_file) {
  const YamlSection yaml = YamlSection::load(file_of(name_or_file));
  yaml.allow_only({"name", "description", "source", "axes", "origin", "mass", "inertia", "centre_of_mass",
                   "centre_of_buoyancy", "weight", "buoyancy", "added_mass", "linear_damping", "quadratic_damping",
                   "lift", "actuators", "most_twist"});
  const std::string word = yaml.has("axes") ? yaml.text("axes") : "FLU";
  if (word != "FRD" && word != "FLU") yaml.fail("axes", fmt::format("axes are FLU or FRD, not {}", quote(word)));
  const Axes axes{word == "FRD"};

  check_sizes(yaml, {"mass", "inertia", "centre_of_mass", "centre_of_buoyancy", "weight", "buoyancy", "added_mass",
                     "linear_damping", "quadratic_damping", "lift", "most_twist"});
  VehicleBody body;
  body.centre_of_mass = axes.turned(yaml.numbers("centre_of_mass", 3));
  body.centre_of_buoyancy = axes.turned(yaml.numbers("centre_of_buoyancy", 3));
  body.weight = yaml.number("weight");
  body.buoyancy = yaml.number("buoyancy");
  body.mass = rigid_body(yaml, body.centre_of_mass, axes) + matrix(yaml, "added_mass", axes);
  body.linear = matrix(yaml, "linear_damping", axes);
  body.quadratic = matrix(yaml, "quadratic_damping", axes);
  body.lift = matrix(yaml, "lift", axes);
  if (const std::string why = why_impossible(body); !why.empty()) yaml.fail(why);

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
  if (actuators.empty() || actuators.size() > kMostActuators)
    yaml.fail("actuators", fmt::format("a vehicle has 1 to {} actuators, not {}", kMostActuators, actuators.size()));
  if (actuators.size() <= 3) {
    vehicle.model = assembled<3>(body, actuators);
  } else {
    vehicle.model = assembled<8>(body, actuators);
  }
  const std::vector<double> most = yaml.numbers("most_twist", 6);
  vehicle.most_twist = Eigen::Map<const Vector<6>>(most.data());
  if (!(vehicle.most_twist.array() > 0).all()) yaml.fail("most_twist", "most_twist must be above zero on every axis");
  return vehicle;
}

}  // namespace tandem
