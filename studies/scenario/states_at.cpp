#include <fmt/format.h>

#include <tandem/studies/scenario/states_at.hpp>
#include <tandem/studies/support/csv.hpp>
#include <tandem/studies/support/output_file.hpp>
#include <tandem/studies/support/state_columns.hpp>

namespace tandem {
namespace {

using OptionalVector = std::optional<Vector<3>>;

/// A body at an instant, in the scenario's frame. All but t and note may be empty.
struct Row {
  double t;
  std::string note;
  OptionalVector position{};
  std::optional<SO3> orientation{};
  OptionalVector velocity{}, angular_velocity{};
  Eigen::MatrixXd covariance{}, twist_covariance{};
};

/// Returns the matrix that takes the tangent of a pose, or of a point, in space or in the plane, to that of the files.
Eigen::MatrixXd to_files(const Frame& frame, Eigen::Index dof, bool point) {
  if (point) return frame.world_axes().leftCols(dof);
  Eigen::MatrixXd axes = Eigen::MatrixXd::Zero(6, 6);
  axes.topLeftCorner<3, 3>() = axes.bottomRightCorner<3, 3>() = frame.body_axes();
  if (dof == 6) return axes;
  Eigen::MatrixXd planar(6, 3);
  planar << axes.col(0), axes.col(1), axes.col(5);
  return planar;
}

/// Returns A S Aᵀ, with infinite variances kept. Each column of A has one nonzero entry, 1 or −1.
Eigen::MatrixXd transformed(const Eigen::MatrixXd& A, const Eigen::MatrixXd& S) {
  const auto known = [](double s) { return std::isfinite(s) ? s : 0; };
  Eigen::MatrixXd result = A * S.unaryExpr(known) * A.transpose();
  for (Eigen::Index j = 0; j < A.cols(); ++j) {
    Eigen::Index i = 0;
    A.col(j).cwiseAbs().maxCoeff(&i);
    if (!std::isfinite(S(j, j))) result(i, i) = S(j, j);
  }
  return result;
}

Row row_of(const StateAt& state, const std::optional<MotionInstant>& body, const Frame& frame) {
  Row row{.t = state.t, .note = state.note};
  if (!body && row.note.empty()) row.note = "before the first keyframe of the target";
  if (!body) return row;
  const SE3 pose = frame.world(SE3(body->rotation.value_or(SO3()), body->position));
  row.position = pose.translation();
  if (body->rotation) row.orientation = pose.rotation();
  const Eigen::Index n = body->twist.size();
  const Eigen::MatrixXd axes = to_files(frame, n, !body->rotation);
  const Eigen::VectorXd twist = axes * body->twist;
  row.velocity = twist.head<3>();
  if (body->rotation) row.angular_velocity = twist.tail<3>();
  if (body->covariance.size() == 0) return row;
  row.covariance = transformed(axes, body->covariance.topLeftCorner(n, n));
  row.twist_covariance = transformed(axes, body->covariance.bottomRightCorner(n, n));
  return row;
}

CsvTable<Row> columns() {
  CsvTable<Row> table;
  table.add("t", "time of the file of --at [s]; one row for each, in its order", [](const Row& r) { return r.t; });
  table.add("note", "the reason if there is no state at this time, else empty", [](const Row& r) { return r.note; });
  add_position_columns(table);
  table.add_xyz("v{}", "velocity along the body axes [m/s]; for a point along the world axes",
                [](const Row& r) { return r.velocity; });
  table.add_xyz("w{}", "angular velocity about the body axes [rad/s]; empty for points",
                [](const Row& r) { return r.angular_velocity; });
  add_covariance_columns(table);
  for (Eigen::Index i = 0; i < 6; ++i)
    for (Eigen::Index j = 0; j < 6; ++j)
      table.add(fmt::format("d{}{}", i + 1, j + 1),
                "covariance of velocity and angular velocity, row by row; for a point the upper left 3 × 3 block",
                [i, j](const Row& r) { return entry_cell(r.twist_covariance, i, j); });
  return table;
}

}  // namespace

std::string why_outside(double t, double first, double last) {
  if (t < first) return fmt::format("before the first keyframe, at {:.3f} s", first);
  if (t > last) return fmt::format("after the last keyframe, at {:.3f} s", last);
  return "";
}

void write_states_at(const std::vector<StateAt>& states, const Frame& frame, bool target,
                     const std::filesystem::path& folder) {
  const CsvTable<Row> table = columns();
  std::string chaser_text = table.header(), target_text = chaser_text;
  for (const StateAt& state : states) {
    chaser_text += table.row(row_of(state, state.chaser, frame));
    if (target) target_text += table.row(row_of(state, state.target, frame));
  }
  write_file(folder / "chaser_at.csv", chaser_text);
  if (target) write_file(folder / "target_at.csv", target_text);
}

std::string states_at_text(const std::vector<StateAt>& states) {
  std::size_t missing = 0;
  const StateAt* first = nullptr;
  for (const StateAt& state : states) {
    if (state.note.empty()) continue;
    ++missing;
    if (!first) first = &state;
  }
  if (missing == 0) return "";
  return fmt::format("--at: {} of the {} times have no state; the first is {:.3f} s: {}.{}\n", missing, states.size(),
                     first->t, first->note,
                     missing == states.size() ? " The times must be in seconds, on the clock of the recording." : "");
}

FileDescription states_at_columns(bool target) {
  return columns().describe(target ? "chaser_at.csv, target_at.csv" : "chaser_at.csv");
}

}  // namespace tandem
