#include <fmt/format.h>

#include <tandem/studies/scenario/sensor_rows.hpp>
#include <tandem/studies/simulation/docking_parameters.hpp>
#include <tandem/studies/simulation/number_rows.hpp>
#include <tandem/studies/simulation/simulate_docking_files.hpp>
#include <tandem/studies/support/output_file.hpp>
#include <tandem/studies/support/tum.hpp>

namespace tandem {

void write_docking(const SimulatedDocking& docking, const DockingOptions& options,
                   const std::filesystem::path& folder) {
  const TrackingNoise& noise = docking.data.noise;
  const auto list = [](const Eigen::VectorXd& v) {
    return fmt::format("[{:g}]", fmt::join(v.data(), v.data() + v.size(), ", "));
  };
  const TargetSensor &usbl = docking.data.sensors[0], &optical = docking.data.sensors[1];
  std::string source = fmt::format("simulated by tandem, seed {}", options.seed);
  if (const std::string changed = changed_parameters(options); !changed.empty()) source += ", " + changed;
  // What a file of positions without a declaration cannot say.
  const bool declared = usbl.type != SensorType::position || usbl.delay != 0;
  write_file(folder / "scenario.yaml",
             fmt::format("name: docking_{}\n"
                         "description: Simulated opto-acoustic rendezvous of {:g} minutes\n"
                         "source: {}\n"
                         "keyframe_interval: {:g}\n"
                         "noise:   # standard deviations [m, rad]; pose tangents ordered x y z, then rotation\n"
                         "  prior: {}\n  odometry: {}\n{}  optical: {}\n  constant_twist: {}\n"
                         "  constant_velocity: {}\n{}",
                         options.seed, options.minutes, source, docking.data.keyframe_interval, list(noise.prior),
                         list(noise.odometry), declared ? "" : fmt::format("  usbl: {}\n", list(usbl.sigma)),
                         list(optical.sigma), list(noise.constant_twist), list(noise.constant_velocity),
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
    for (const Measurement& m : sensor->measurements) {
      Eigen::VectorXd row(sensor->type == SensorType::pose ? 7 : 3);
      if (sensor->type == SensorType::range_bearing)
        row = Vector<3>(m.range, m.azimuth, m.elevation);
      else
        row.head<3>() = m.position;
      if (row.size() == 7) row.tail<4>() = m.rotation.quaternion().coeffs();
      rows.push_back({m.t, row});
    }
    const auto table = number_columns(columns(sensor->type, false), 3, [](const std::string& name, double value) {
      return CsvCell::fixed(value, name.starts_with("q") ? 8 : 5);
    });
    write_file(folder / (sensor->name + ".csv"), table.text(rows));
  }
}

}  // namespace tandem
