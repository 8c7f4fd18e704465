#include <tandem/studies/demo/demo_fig3_files.hpp>
#include <tandem/studies/support/output_file.hpp>

namespace tandem::fig3 {
namespace {

struct PoseRow {
  std::size_t panel, pose;
  const Solution& solution;

  const SE3& start() const { return solution.start[pose]; }
  const SE3& solved() const { return solution.solved[pose]; }
};

Vector<4> quaternion(const SE3& pose) { return pose.rotation().quaternion().coeffs(); }

CsvTable<PoseRow> columns() {
  const std::vector<std::string> xyzw = {"x", "y", "z", "w"};
  return CsvTable<PoseRow>()
      .add("panel", "from 1", [](const PoseRow& r) { return r.panel + 1; })
      .add("title", "of the panel", [](const PoseRow& r) { return r.solution.panel.title; })
      .add("pose", "from 0", [](const PoseRow& r) { return r.pose; })
      .add("t", "its time [s]", [](const PoseRow& r) { return r.solution.panel.poses[r.pose].t; })
      .add("given", "1: on the arc, and kept there",
           [](const PoseRow& r) { return r.solution.panel.poses[r.pose].given; })
      .add_xyz("start_{}_m", "position of the initial guess [m]",
               [](const PoseRow& r) { return Vector<3>(r.start().translation()); })
      .add_each(xyzw, "start_q{}", "its orientation, a Hamilton quaternion",
                [](const PoseRow& r) { return quaternion(r.start()); })
      .add("start_off_arc_m", "its distance from the arc [m]",
           [](const PoseRow& r) { return off_arc(r.start()).distance; })
      .add_xyz("{}_m", "position as solved [m]", [](const PoseRow& r) { return Vector<3>(r.solved().translation()); })
      .add_each(xyzw, "q{}", "orientation as solved", [](const PoseRow& r) { return quaternion(r.solved()); })
      .add("off_arc_m", "its distance from the arc [m]", [](const PoseRow& r) { return off_arc(r.solved()).distance; })
      .add("iterations", "of the panel's solve", [](const PoseRow& r) { return r.solution.summary.iterations; });
}

}  // namespace

void write_poses(const std::vector<Solution>& solutions, const std::filesystem::path& folder) {
  std::vector<PoseRow> rows;
  for (std::size_t i = 0; i < solutions.size(); ++i)
    for (std::size_t k = 0; k < solutions[i].solved.size(); ++k) rows.push_back({i, k, solutions[i]});
  write_file(folder / "fig3.csv", columns().text(rows));
}

std::vector<CsvDescription> file_columns() { return {columns().describe("fig3.csv")}; }

}  // namespace tandem::fig3
