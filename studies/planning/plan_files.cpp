#include <tandem/studies/planning/plan_files.hpp>
#include <tandem/studies/planning/plan_report.hpp>
#include <tandem/studies/support/output_file.hpp>
#include <tandem/studies/support/state_columns.hpp>
#include <tandem/studies/support/units.hpp>

namespace tandem {
namespace {

/// State of chaser or target at one instant of the plan, in the scenario's frame.
struct PlanRow {
  double t;
  Vector<3> position;
  std::optional<SO3> orientation;
  Vector<3> velocity, angular_velocity, three_sigma, three_sigma_rotation;
  double distance, miss;
};

PlanRow plan_row(const PlannedRun& run, const PlannedInstant& at, bool target) {
  const Frame& frame = run.frame;
  const SE3 pose = frame.world(target ? at.target : at.chaser);
  const Matrix<6, 6>& S = at.target_covariance;
  const Matrix<3, 3> R = at.target.rotation().matrix();
  const Matrix<3, 3> position = R * S.topLeftCorner<3, 3>() * R.transpose(), axes = frame.world_axes();
  const Vector<3> rotation = S.bottomRightCorner<3, 3>().diagonal();
  return {at.t,
          pose.translation(),
          pose.rotation(),
          frame.body(Vector<3>(at.twist.head<3>())),
          frame.body(Vector<3>(at.twist.tail<3>())),
          3.0 * Matrix<3, 3>(axes * position * axes.transpose()).diagonal().cwiseSqrt(),
          3.0 * kDegrees * rotation.cwiseSqrt(),
          (at.chaser.translation() - at.target.translation()).norm(),
          (at.chaser.translation() - at.target.act(run.request.plan.goal.translation())).norm()};
}

CsvTable<PlanRow> chaser_columns() {
  CsvTable<PlanRow> table;
  add_pose_columns(table);
  table.add_xyz("v{}", "velocity over the ground along the body's axes [m/s]",
                [](const PlanRow& r) { return r.velocity; });
  table.add_xyz("w{}", "angular velocity about the body's axes [rad/s]",
                [](const PlanRow& r) { return r.angular_velocity; });
  table.add("distance_m", "distance between the origins of the two bodies [m]",
            [](const PlanRow& r) { return r.distance; });
  table.add("miss_m", "distance from the goal position [m]", [](const PlanRow& r) { return r.miss; });
  return table;
}

CsvTable<PlanRow> target_columns() {
  CsvTable<PlanRow> table;
  add_pose_columns(table);
  table.add_xyz("three_sigma_{}_m",
                "3 σ of the predicted position along the world's axes, relative to the chaser at the start [m]",
                [](const PlanRow& r) { return r.three_sigma; });
  table.add_xyz("three_sigma_r{}_deg", "3 σ of the predicted orientation about the target's axes [deg]",
                [](const PlanRow& r) { return r.three_sigma_rotation; });
  return table;
}

CsvTable<PlannedInstant> command_columns(const std::vector<std::string>& actuators) {
  CsvTable<PlannedInstant> table;
  table.add("t", "start of the step [s]", [](const PlannedInstant& i) { return i.t; });
  for (std::size_t a = 0; a < actuators.size(); ++a) {
    table.add(
        actuators[a] + "_command", "command held over the step, in the unit of the vehicle file; empty in the last row",
        [a](const PlannedInstant& i) { return i.command.size() ? CsvCell(i.command[Eigen::Index(a)]) : CsvCell(); });
    table.add(actuators[a], "state of the actuator at t, after its lag",
              [a](const PlannedInstant& i) { return i.actuators[Eigen::Index(a)]; });
  }
  return table;
}

CsvTable<ActiveConstraint> active_columns() {
  return CsvTable<ActiveConstraint>()
      .add("constraint", "residual and variables", [](const ActiveConstraint& c) { return c.constraint; })
      .add("value", "value of the constraint, in the residual's units",
           [](const ActiveConstraint& c) { return c.value; })
      .add("bound", "the active bound, in the residual's units", [](const ActiveConstraint& c) { return c.bound; })
      .add("multiplier", "decrease of the cost per unit of relaxation, to first order",
           [](const ActiveConstraint& c) { return c.multiplier; });
}

std::string body_csv(const PlannedRun& run, const CsvTable<PlanRow>& table, bool target) {
  std::vector<PlanRow> rows;
  for (const PlannedInstant& instant : run.instants) rows.push_back(plan_row(run, instant, target));
  return table.text(rows);
}

}  // namespace

void write_plan(const PlannedRun& run, const std::filesystem::path& folder) {
  write_file(folder / "planned_chaser.csv", body_csv(run, chaser_columns(), false));
  write_file(folder / "predicted_target.csv", body_csv(run, target_columns(), true));
  write_file(folder / "commands.csv", command_columns(run.vehicle.actuators).text(run.instants));
  write_file(folder / "active_constraints.csv", active_columns().text(run.active));
  write_file(folder / "summary.json", plan_json(run));
}

std::vector<FileDescription> plan_file_columns(const std::vector<std::string>& actuators) {
  return {chaser_columns().describe("planned_chaser.csv"), target_columns().describe("predicted_target.csv"),
          command_columns(actuators).describe("commands.csv"), active_columns().describe("active_constraints.csv")};
}

}  // namespace tandem
