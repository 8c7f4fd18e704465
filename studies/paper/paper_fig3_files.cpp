#include <tandem/studies/paper/paper_fig3_files.hpp>
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
      .add("panel", "number of the panel, from 1", [](const PoseRow& r) { return r.panel + 1; })
      .add("title", "title of the panel", [](const PoseRow& r) { return r.solution.panel.title; })
      .add("pose", "number of the pose in the panel, from 0", [](const PoseRow& r) { return r.pose; })
      .add("t", "time of the pose [s]", [](const PoseRow& r) { return r.solution.panel.poses[r.pose].t; })
      .add("given", "1: the pose is fixed on the arc; 0: it is estimated",
           [](const PoseRow& r) { return r.solution.panel.poses[r.pose].given; })
      .add_xyz("start_{}_m", "position of the initial guess [m]",
               [](const PoseRow& r) { return Vector<3>(r.start().translation()); })
      .add_each(xyzw, "start_q{}", "orientation of the initial guess, a Hamilton quaternion",
                [](const PoseRow& r) { return quaternion(r.start()); })
      .add("start_off_arc_m", "distance of the initial guess from the arc [m]",
           [](const PoseRow& r) { return off_arc(r.start()).distance; })
      .add_xyz("{}_m", "position of the solution [m]",
               [](const PoseRow& r) { return Vector<3>(r.solved().translation()); })
      .add_each(xyzw, "q{}", "orientation of the solution, a Hamilton quaternion",
                [](const PoseRow& r) { return quaternion(r.solved()); })
      .add("off_arc_m", "distance of the solution from the arc [m]",
           [](const PoseRow& r) { return off_arc(r.solved()).distance; })
      .add("iterations", "number of iterations of the panel's solve",
           [](const PoseRow& r) { return r.solution.summary.iterations; });
}

}  // namespace

void write_poses(const std::vector<Solution>& solutions, const std::filesystem::path& folder) {
  std::vector<PoseRow> rows;
  for (std::size_t i = 0; i < solutions.size(); ++i)
    for (std::size_t k = 0; k < solutions[i].solved.size(); ++k) rows.push_back({i, k, solutions[i]});
  write_file(folder / "fig3.csv", columns().text(rows));
}

std::vector<FileDescription> file_columns() { return {columns().describe("fig3.csv")}; }

}  // namespace tandem::fig3
