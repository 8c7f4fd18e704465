#include <fmt/format.h>
#include <fmt/ranges.h>

#include <tandem/problem/tracking/planar.hpp>
#include <tandem/studies/scenario/sensor_rows.hpp>
#include <tandem/studies/simulation/docking_parameters.hpp>
#include <tandem/studies/simulation/number_rows.hpp>
#include <tandem/studies/simulation/simulate_docking_files.hpp>
#include <tandem/studies/support/output_file.hpp>
#include <tandem/studies/support/tum.hpp>

namespace tandem {
namespace {

/// Returns the values of a row after its time, in the order of columns().
Eigen::VectorXd row_of(SensorType type, const Measurement& m, bool planar) {
  const Eigen::Index dim = planar ? 2 : 3;
  if (type == SensorType::range_bearing) return Vector<3>(m.range, m.azimuth, m.elevation).head(dim);
  if (type == SensorType::position) return m.position.head(dim);
  if (planar) return Vector<3>(m.position.x(), m.position.y(), heading(m.rotation));
  Eigen::VectorXd row(7);
  row << m.position, m.rotation.quaternion().coeffs();
  return row;
}

}  // namespace

void write_docking(const SimulatedDocking& docking, const DockingOptions& options,
                   const std::filesystem::path& folder) {
  const TrackingNoise& noise = docking.data.noise;
  const auto list = [](const Eigen::VectorXd& v) {
    return fmt::format("[{:g}]", fmt::join(v.data(), v.data() + v.size(), ", "));
  };
  const TargetSensor &usbl = docking.data.sensors[0], &optical = docking.data.sensors[1];
  std::string source = fmt::format("simulated by tandem, seed {}", options.seed);
  if (const std::string changed = changed_parameters(options); !changed.empty()) source += ", " + changed;
  // usbl.csv without an entry in `sensors:` is a position sensor without delay.
  const bool declared = usbl.type != SensorType::position || usbl.delay != 0;
  write_file(folder / "scenario.yaml",
             fmt::format("name: docking_{}\n"
                         "description: Simulated opto-acoustic rendezvous of {:g} minutes\n"
                         "source: {}\n{}"
                         "keyframe_interval: {:g}\n"
                         "noise:   # standard deviations [m, rad]; pose tangents ordered x y z, then rotation\n"
                         "  prior: {}\n  odometry: {}\n{}  optical: {}\n  constant_twist: {}\n"
                         "  constant_velocity: {}\n{}",
                         options.seed, options.minutes, source, options.planar ? "group: SE2\n" : "",
                         docking.data.keyframe_interval, list(noise.prior), list(noise.odometry),
                         declared ? "" : fmt::format("  usbl: {}\n", list(usbl.sigma)), list(optical.sigma),
                         list(noise.constant_twist), list(noise.constant_velocity),
                         declared ? fmt::format("sensors:\n  usbl: {{type: {}, file: usbl.csv, sigma: {}, delay: {:g}, "
                                                "position: [0, 0, 0]}}\n",
                                                usbl.type->name, list(usbl.sigma), usbl.delay)
                                  : ""));

  const auto write_poses = [&](const std::string& file, const std::vector<Stamped<SE3>>& poses) {
    std::string text = tum_header;
    for (const auto& [t, pose] : poses) text += tum_row(t, pose, TumDecimals{3, 5, 8});
    write_file(folder / file, text);
  };
  write_poses("chaser_odometry.tum", docking.data.odometry);
  write_poses("truth_chaser.tum", docking.truth_chaser);
  write_poses("truth_target.tum", docking.truth_target);

  for (const TargetSensor* sensor : {&usbl, &optical}) {
    std::vector<NumberRow> rows;
    for (const Measurement& m : sensor->measurements) rows.push_back({m.t, row_of(sensor->type, m, options.planar)});
    const auto table = number_columns(
        columns(sensor->type, options.planar), 3,
        [](const std::string& name, double value) { return CsvCell::fixed(value, name.starts_with("q") ? 8 : 5); });
    write_file(folder / (sensor->name + ".csv"), table.text(rows));
  }
}

}  // namespace tandem
