#include <algorithm>
#include <map>

#include <fmt/format.h>

#include <tandem/studies/study/study_report.hpp>
#include <tandem/studies/support/output_file.hpp>
#include <tandem/studies/support/text_table.hpp>

namespace tandem {
namespace {

constexpr StudyColumn kColumns[] = {
    {"at_position_error_m", "raw_at_position_error_m", "position [m]", 3},
    {"at_pose_error_m", "raw_at_pose_error_m", "pose [m]", 3},
    {"at_partial_error_m", nullptr, "partial [m]", 3},
    {"at_none_error_m", nullptr, "none [m]", 3},
    {"at_position_orientation_deg", nullptr, "position [°]", 2},
    {"at_pose_orientation_deg", "raw_at_pose_orientation_deg", "pose [°]", 2},
    {"at_partial_orientation_deg", nullptr, "partial [°]", 2},
    {"at_none_orientation_deg", nullptr, "none [°]", 2},
    {"gap_position_m", nullptr, "in gaps [m]", 3},
    {"after_gap_position_m", nullptr, "after gaps [m]", 3},
    {"chaser_position_m", nullptr, "chaser [m]", 3},
    {"chaser_outage_position_m", nullptr, "in outages [m]", 3},
    {"chaser_orientation_deg", nullptr, "chaser [°]", 3},
    {"chaser_velocity_mps", nullptr, "chaser [m/s]", 4},
    {"docked", nullptr, "docked", 0},
    {"dock_s", nullptr, "time [s]", 1},
    {"dock_miss_m", nullptr, "miss [m]", 2},
    {"effort_s", nullptr, "effort [s]", 1},
    {"dock_three_sigma_m", nullptr, "3 σ [m]", 2},
    {"keep_out_violation_m", nullptr, "inside keep-out [m]", 2},
    {"cost", nullptr, "cost", 1},
    {"iterations", nullptr, "iterations", 1},
};

/// Look-up of means by group and metric.
class MeanLookup {
 public:
  explicit MeanLookup(const std::vector<StudyMean>& means) {
    for (const StudyMean& row : means) means_.emplace(std::pair(row.group, row.metric), row.mean);
  }
  const Interval* operator()(const StudyGroup& group, const std::string& metric) const {
    const auto found = means_.find({&group, metric});
    return found == means_.end() ? nullptr : &found->second;
  }

 private:
  std::map<std::pair<const StudyGroup*, std::string>, Interval> means_;
};

std::string share_text(const Interval& share) {
  return fmt::format("{:.0f} % ({:.0f} … {:.0f})", 100 * share.value, 100 * share.low, 100 * share.high);
}

std::string interval_cell(const Interval* mean, int decimals) {
  if (!mean) return "–";
  return fmt::format("{:.{}f} ± {:.{}f}", mean->value, decimals, mean->high - mean->value, decimals);
}

std::string group_name(const Study& study, const StudyGroup& group) {
  std::string name = group.model_text;
  if (study.solvers.size() > 1) name += ", " + group.solver_text;
  return name;
}

/// Returns the table of one cell of the grid.
std::string errors_table(const Study& study, const StudyTables& tables, const MeanLookup& mean, std::size_t cell) {
  std::vector<const StudyGroup*> groups;
  for (const StudyGroup& group : tables.groups)
    if (group.cell == cell) groups.push_back(&group);
  std::vector<StudyColumn> columns;
  for (const StudyColumn& column : kColumns)
    if (std::any_of(groups.begin(), groups.end(), [&](const StudyGroup* g) { return mean(*g, column.metric); }))
      columns.push_back(column);

  std::vector<TextTable::Column> heads = {{"", TextTable::Align::left}};
  for (const StudyColumn& column : columns) heads.push_back({column.head});
  heads.push_back({"trials"});
  heads.push_back({"converged"});
  if (tables.disturbs_initial_guess) heads.push_back({"at the best cost"});
  TextTable table(heads);
  std::vector<std::string> raw = {"raw"};
  for (const StudyColumn& column : columns)
    raw.push_back(interval_cell(column.raw ? mean(*groups.front(), column.raw) : nullptr, column.decimals));
  raw.resize(heads.size());
  if (std::any_of(columns.begin(), columns.end(), [](const StudyColumn& column) { return column.raw; })) table.row(raw);
  for (const StudyGroup* group : groups) {
    std::vector<std::string> cells = {group_name(study, *group)};
    for (const StudyColumn& column : columns) cells.push_back(mean_text(column, mean(*group, column.metric)));
    cells.push_back(fmt::format("{}", group->trials));
    cells.push_back(fmt::format("{}", group->converged));
    if (tables.disturbs_initial_guess) {
      const auto share = share_interval(group->reached_best, group->trials);
      cells.push_back(share ? share_text(*share) : "–");
    }
    table.row(cells);
  }
  const std::string& heading = groups.front()->cell_text;
  return (heading.empty() ? "" : heading + "\n") + table.str() + "\n";
}

std::string group_text(const Study& study, const StudyGroup& group) {
  return group.cell_text.empty() ? group_name(study, group)
                                 : fmt::format("{}: {}", group.cell_text, group_name(study, group));
}

CsvTable<StudyMean> mean_columns() {
  return CsvTable<StudyMean>()
      .add("cell", "grid cell: values of the parameters that vary",
           [](const StudyMean& r) { return r.group->cell_text; })
      .add("model", "motion model and constraints", [](const StudyMean& r) { return r.group->model_text; })
      .add("solver", "name of the solver in the study file", [](const StudyMean& r) { return r.group->solver_text; })
      .add("metric", "column of trials.csv", [](const StudyMean& r) { return r.metric; })
      .add("n", "number of converged trials with this metric", [](const StudyMean& r) { return r.mean.n; })
      .add("mean", "mean over these trials", [](const StudyMean& r) { return r.mean.value; })
      .add("low", "lower limit of the 95 % confidence interval: Student's t, or Wilson's for a share",
           [](const StudyMean& r) { return r.mean.low; })
      .add("high", "upper limit of the 95 % confidence interval", [](const StudyMean& r) { return r.mean.high; });
}

CsvTable<StudyPair> pair_columns() {
  return CsvTable<StudyPair>()
      .add("cell", "grid cell: values of the parameters that vary",
           [](const StudyPair& r) { return r.group->cell_text; })
      .add("model", "motion model and constraints", [](const StudyPair& r) { return r.group->model_text; })
      .add("solver", "name of the solver in the study file", [](const StudyPair& r) { return r.group->solver_text; })
      .add("against", "reference: raw measurements, or the first model of the study",
           [](const StudyPair& r) { return r.base; })
      .add("metric", "column of trials.csv", [](const StudyPair& r) { return r.metric; })
      .add("n", "number of seeds on which both converged", [](const StudyPair& r) { return r.ratio.n; })
      .add("ratio", "mean of the model divided by the mean of the reference",
           [](const StudyPair& r) { return r.ratio.value; })
      .add("low", "lower limit of the 95 % confidence interval", [](const StudyPair& r) { return r.ratio.low; })
      .add("high", "upper limit of the 95 % confidence interval", [](const StudyPair& r) { return r.ratio.high; });
}

CsvTable<StudyConsistency> consistency_columns() {
  using Row = StudyConsistency;
  return CsvTable<Row>()
      .add("cell", "grid cell: values of the parameters that vary", [](const Row& r) { return r.group->cell_text; })
      .add("model", "motion model and constraints", [](const Row& r) { return r.group->model_text; })
      .add("solver", "name of the solver in the study file", [](const Row& r) { return r.group->solver_text; })
      .add("metric", "column of trials.csv", [](const Row& r) { return r.metric; })
      .add("degrees", "degrees of freedom: the expected mean of a consistent estimator",
           [](const Row& r) { return r.degrees; })
      .add("n", "number of trials", [](const Row& r) { return r.mean.n; })
      .add("mean", "mean over trials: ANEES, or mean NIS", [](const Row& r) { return r.mean.value; })
      .add("low", "lower limit of the 95 % confidence interval of the mean", [](const Row& r) { return r.mean.low; })
      .add("high", "upper limit of the 95 % confidence interval of the mean", [](const Row& r) { return r.mean.high; })
      .add("band_low", "lower limit of the 95 % band of the mean of a consistent estimator (χ²)",
           [](const Row& r) { return r.low; })
      .add("band_high", "upper limit of the 95 % band of the mean of a consistent estimator (χ²)",
           [](const Row& r) { return r.high; })
      .add("sigma_factor", "ratio of the actual errors to the stated σ", [](const Row& r) { return r.sigma_factor; })
      .add("verdict", "consistent; or optimistic (σ too small) or pessimistic (σ too large) by a factor",
           [](const Row& r) { return r.verdict; });
}

struct TrialRow {
  const Study* study;
  const TrialResult* result;
  TrialPlace place;
};

CsvTable<TrialRow> trial_columns(const Study& study) {
  CsvTable<TrialRow> table;
  table.add("trial", "number of the trial", [](const TrialRow& r) { return r.result->trial; })
      .add("replicate", "index of the seed", [](const TrialRow& r) { return r.place.replicate; });
  for (std::size_t a = 0; a < study.axes.size(); ++a)
    table.add(study.axes[a].parameter, "value of this parameter",
              [a](const TrialRow& r) { return r.study->axes[a].values[r.place.values[a]]; });
  table.add("model", "motion model and constraints", [](const TrialRow& r) { return r.study->models[r.place.model]; })
      .add("solver", "name of the solver in the study file",
           [](const TrialRow& r) { return r.study->solvers[r.place.solver]; })
      .add("status", "converged; else the solver's status, or refused if nothing was solved",
           [](const TrialRow& r) { return r.result->status; })
      .add("message", "reason if the trial did not converge", [](const TrialRow& r) { return r.result->message; });
  for (std::size_t m = 0; m < trial_metrics().size(); ++m)
    table.add(trial_metrics()[m].name, trial_metrics()[m].doc, [m](const TrialRow& r) { return r.result->metrics[m]; });
  return table;
}

}  // namespace

std::vector<StudyColumn> study_columns(const StudyTables& tables) {
  std::vector<StudyColumn> columns;
  for (const StudyColumn& column : kColumns)
    if (std::any_of(tables.means.begin(), tables.means.end(),
                    [&](const StudyMean& mean) { return mean.metric == column.metric; }))
      columns.push_back(column);
  return columns;
}

std::string study_columns_text(const Study& study) {
  const std::string means = "Means over seeds ± half width of the 95 % confidence interval: ";
  if (study.settings(study.place(0)).rendezvous) return means + "rendezvous; docking rate with Wilson's interval.";
  if (!study.has_target()) return means + "errors of the chaser.";
  return means + "errors of the relative pose by the measurement at the keyframe.";
}

std::string mean_text(const StudyColumn& column, const Interval* mean) {
  if (mean && trial_metrics()[metric_index(column.metric)].share) return share_text(*mean);
  return interval_cell(mean, column.decimals);
}

std::string study_report(const Study& study, const StudyTables& tables) {
  std::string text =
      fmt::format("{}{}\n{} of {} trials, hash {:016x}\n\n", study.name,
                  study.question.empty() ? "" : ": " + study.question, tables.trials, tables.all, study.hash());
  text += study_columns_text(study);
  if (study.models.size() > 1)
    text += "\nIf models converged on different seeds, compare them by the ratios below only.";
  text += "\n\n";
  const MeanLookup mean(tables.means);
  for (std::size_t cell = 0; cell < study.cells(); ++cell) text += errors_table(study, tables, mean, cell);

  TextTable pairs({{"Paired comparison", TextTable::Align::left},
                   {"relative to", TextTable::Align::left},
                   {"metric", TextTable::Align::left},
                   {"ratio"},
                   {"95 % interval"}});
  for (const StudyPair& row : tables.pairs)
    pairs.row({group_text(study, *row.group), row.base, row.metric, fmt::format("{:.3f}", row.ratio.value),
               fmt::format("{:.3f} … {:.3f}", row.ratio.low, row.ratio.high)});
  if (!tables.pairs.empty()) text += pairs.str() + "\n";

  TextTable consistency({{"Consistency", TextTable::Align::left},
                         {"metric", TextTable::Align::left},
                         {"mean / dof"},
                         {"95 % band"},
                         {"verdict", TextTable::Align::left}});
  for (const StudyConsistency& row : tables.consistency)
    consistency.row({group_text(study, *row.group), row.metric, fmt::format("{:.2f} / {}", row.mean.value, row.degrees),
                     fmt::format("{:.2f} … {:.2f}", row.low, row.high), row.verdict});
  if (!tables.consistency.empty()) text += consistency.str();
  return text;
}

std::string study_timing(const StudyTables& tables) {
  const MeanLookup mean(tables.times);
  TextTable table({{"Time per trial", TextTable::Align::left}, {"solve [s]"}, {"processor, whole trial [s]"}});
  for (const StudyGroup& group : tables.groups) {
    std::string name = group.cell_text.empty() ? "" : group.cell_text + ": ";
    name += group.model_text + ", " + group.solver_text;
    table.row({name, interval_cell(mean(group, "solve_s"), 3), interval_cell(mean(group, "processor_s"), 3)});
  }
  return table.str();
}

void write_study_tables(const Study& study, const StudyTables& tables, const std::filesystem::path& folder) {
  write_file(folder / "tables.txt", study_report(study, tables));
  write_file(folder / "summary.csv", mean_columns().text(tables.means));
  write_file(folder / "pairs.csv", pair_columns().text(tables.pairs));
  write_file(folder / "consistency.csv", consistency_columns().text(tables.consistency));
  write_file(folder / "timing.csv", mean_columns().text(tables.times));
}

std::string trials_csv(const Study& study, const std::vector<TrialResult>& results) {
  std::vector<TrialRow> rows;
  for (const TrialResult& result : results) rows.push_back({&study, &result, study.place(result.trial)});
  return trial_columns(study).text(rows);
}

std::vector<FileDescription> study_file_columns() {
  return {mean_columns().describe("summary.csv"), pair_columns().describe("pairs.csv"),
          consistency_columns().describe("consistency.csv"), mean_columns().describe("timing.csv"),
          trial_columns({}).describe("trials.csv")};
}

}  // namespace tandem
