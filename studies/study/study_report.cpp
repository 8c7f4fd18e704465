#include <algorithm>
#include <map>

#include <fmt/format.h>

#include <tandem/studies/study/study_report.hpp>
#include <tandem/studies/support/output_file.hpp>
#include <tandem/studies/support/text_table.hpp>

namespace tandem {
namespace {

constexpr StudyColumn kColumns[] = {
    {"usbl_position_m", "raw_usbl_position_m", "usbl [m]", 3},
    {"optical_position_m", "raw_optical_position_m", "optical [m]", 3},
    {"gated_position_m", nullptr, "gated [m]", 3},
    {"usbl_orientation_deg", nullptr, "usbl [°]", 2},
    {"optical_orientation_deg", "raw_optical_orientation_deg", "optical [°]", 2},
    {"gated_orientation_deg", nullptr, "gated [°]", 2},
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

/// Means by group and metric.
class MeanOf {
 public:
  explicit MeanOf(const std::vector<StudyMean>& means) {
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

std::string spread_cell(const Interval* mean, int decimals) {
  if (!mean) return "–";
  return fmt::format("{:.{}f} ± {:.{}f}", mean->value, decimals, mean->high - mean->value, decimals);
}

std::string group_name(const Study& study, const StudyGroup& group) {
  std::string name = group.model_text;
  if (study.solvers.size() > 1) name += ", " + group.solver_text;
  return name;
}

/// The table of one cell of the grid, or of all of them.
std::string errors_table(const Study& study, const StudyTables& tables, const MeanOf& mean, std::size_t cell) {
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
  if (tables.disturbed_starts) heads.push_back({"at the best cost"});
  TextTable table(heads);
  std::vector<std::string> raw = {"raw"};
  for (const StudyColumn& column : columns)
    raw.push_back(spread_cell(column.raw ? mean(*groups.front(), column.raw) : nullptr, column.decimals));
  raw.resize(heads.size());
  if (std::any_of(columns.begin(), columns.end(), [](const StudyColumn& column) { return column.raw; })) table.row(raw);
  for (const StudyGroup* group : groups) {
    std::vector<std::string> cells = {group_name(study, *group)};
    for (const StudyColumn& column : columns) cells.push_back(mean_text(column, mean(*group, column.metric)));
    cells.push_back(fmt::format("{}", group->trials));
    cells.push_back(fmt::format("{}", group->converged));
    if (tables.disturbed_starts) {
      const auto share = share_interval(group->reached_best, group->trials);
      cells.push_back(share ? share_text(*share) : "–");
    }
    table.row(cells);
  }
  const std::string& heading = groups.front()->cell_text;
  return (heading.empty() ? "" : heading + "\n") + table.str() + "\n";
}

std::string place_text(const Study& study, const StudyGroup& group) {
  return group.cell_text.empty() ? group_name(study, group)
                                 : fmt::format("{}: {}", group.cell_text, group_name(study, group));
}

CsvTable<StudyMean> mean_columns() {
  return CsvTable<StudyMean>()
      .add("cell", "values of the parameters that have several", [](const StudyMean& r) { return r.group->cell_text; })
      .add("model", "motion model and constraints", [](const StudyMean& r) { return r.group->model_text; })
      .add("solver", "as the study names it", [](const StudyMean& r) { return r.group->solver_text; })
      .add("metric", "a column of trials.csv", [](const StudyMean& r) { return r.metric; })
      .add("n", "converged trials that have it", [](const StudyMean& r) { return r.mean.n; })
      .add("mean", "over them", [](const StudyMean& r) { return r.mean.value; })
      .add("low", "of its 95 % confidence interval; of a share by Wilson",
           [](const StudyMean& r) { return r.mean.low; })
      .add("high", "likewise", [](const StudyMean& r) { return r.mean.high; });
}

CsvTable<StudyPair> pair_columns() {
  return CsvTable<StudyPair>()
      .add("cell", "values of the parameters that have several", [](const StudyPair& r) { return r.group->cell_text; })
      .add("model", "motion model and constraints", [](const StudyPair& r) { return r.group->model_text; })
      .add("solver", "as the study names it", [](const StudyPair& r) { return r.group->solver_text; })
      .add("against", "raw measurements, or the study's first model", [](const StudyPair& r) { return r.base; })
      .add("metric", "a column of trials.csv", [](const StudyPair& r) { return r.metric; })
      .add("n", "seeds of which both have converged", [](const StudyPair& r) { return r.ratio.n; })
      .add("ratio", "of the means, the model's by the other's", [](const StudyPair& r) { return r.ratio.value; })
      .add("low", "of its 95 % confidence interval", [](const StudyPair& r) { return r.ratio.low; })
      .add("high", "likewise", [](const StudyPair& r) { return r.ratio.high; });
}

CsvTable<StudyConsistency> consistency_columns() {
  using Row = StudyConsistency;
  return CsvTable<Row>()
      .add("cell", "values of the parameters that have several", [](const Row& r) { return r.group->cell_text; })
      .add("model", "motion model and constraints", [](const Row& r) { return r.group->model_text; })
      .add("solver", "as the study names it", [](const Row& r) { return r.group->solver_text; })
      .add("metric", "a column of trials.csv", [](const Row& r) { return r.metric; })
      .add("degrees", "of freedom: what it is where errors are as their covariances say",
           [](const Row& r) { return r.degrees; })
      .add("n", "trials", [](const Row& r) { return r.mean.n; })
      .add("mean", "over trials: ANEES, or the mean NIS", [](const Row& r) { return r.mean.value; })
      .add("low", "of the mean's 95 % confidence interval", [](const Row& r) { return r.mean.low; })
      .add("high", "likewise", [](const Row& r) { return r.mean.high; })
      .add("band_low", "of the 95 % band of such a mean where consistent, by χ²", [](const Row& r) { return r.low; })
      .add("band_high", "likewise", [](const Row& r) { return r.high; })
      .add("sigma_factor", "how many times larger errors are than the σ stated",
           [](const Row& r) { return r.sigma_factor; })
      .add("verdict", "consistent, or optimistic or pessimistic by a factor", [](const Row& r) { return r.verdict; });
}

struct TrialRow {
  const Study* study;
  const TrialResult* result;
  TrialPlace place;
};

CsvTable<TrialRow> trial_columns(const Study& study) {
  CsvTable<TrialRow> table;
  table.add("trial", "its number, by which it can be run again", [](const TrialRow& r) { return r.result->trial; })
      .add("replicate", "which seed", [](const TrialRow& r) { return r.place.replicate; });
  for (std::size_t a = 0; a < study.axes.size(); ++a)
    table.add(study.axes[a].parameter, "value of this parameter",
              [a](const TrialRow& r) { return r.study->axes[a].values[r.place.values[a]]; });
  table.add("model", "motion model and constraints", [](const TrialRow& r) { return r.study->models[r.place.model]; })
      .add("solver", "as the study names it", [](const TrialRow& r) { return r.study->solvers[r.place.solver]; })
      .add("status", "converged, or why not: of a solver, or refused",
           [](const TrialRow& r) { return r.result->status; })
      .add("message", "a sentence, where it did not", [](const TrialRow& r) { return r.result->message; });
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
  const std::string means = "Means over seeds ± half their 95 % interval, ";
  if (study.settings(study.place(0)).rendezvous) return means + "of rendezvous; the share that docked by Wilson's.";
  if (!study.has_target()) return means + "of errors of the chaser.";
  return means + "of the relative pose by type of keyframe.";
}

std::string mean_text(const StudyColumn& column, const Interval* mean) {
  if (mean && trial_metrics()[metric_index(column.metric)].share) return share_text(*mean);
  return spread_cell(mean, column.decimals);
}

std::string study_report(const Study& study, const StudyTables& tables) {
  std::string text =
      fmt::format("{}{}\n{} of {} trials, hash {:016x}\n\n", study.name,
                  study.question.empty() ? "" : ": " + study.question, tables.trials, tables.all, study.hash());
  text += study_columns_text(study);
  if (study.models.size() > 1)
    text += " Models that have not converged\non the same seeds compare by the ratios below alone.";
  text += "\n\n";
  const MeanOf mean(tables.means);
  for (std::size_t cell = 0; cell < study.cells(); ++cell) text += errors_table(study, tables, mean, cell);

  TextTable pairs({{"On the same noise", TextTable::Align::left},
                   {"times the error of", TextTable::Align::left},
                   {"at", TextTable::Align::left},
                   {"ratio"},
                   {"95 % interval"}});
  for (const StudyPair& row : tables.pairs)
    pairs.row({place_text(study, *row.group), row.base, row.metric, fmt::format("{:.3f}", row.ratio.value),
               fmt::format("{:.3f} … {:.3f}", row.ratio.low, row.ratio.high)});
  if (!tables.pairs.empty()) text += pairs.str() + "\n";

  TextTable consistency({{"Consistency", TextTable::Align::left},
                         {"", TextTable::Align::left},
                         {"mean"},
                         {"95 % band"},
                         {"verdict", TextTable::Align::left}});
  for (const StudyConsistency& row : tables.consistency)
    consistency.row({place_text(study, *row.group), row.metric,
                     fmt::format("{:.2f} of {}", row.mean.value, row.degrees),
                     fmt::format("{:.2f} … {:.2f}", row.low, row.high), row.verdict});
  if (!tables.consistency.empty()) text += consistency.str();
  return text;
}

std::string study_timing(const StudyTables& tables) {
  const MeanOf mean(tables.times);
  TextTable table({{"Time of a trial", TextTable::Align::left}, {"solve [s]"}, {"all, of the processor [s]"}});
  for (const StudyGroup& group : tables.groups) {
    std::string name = group.cell_text.empty() ? "" : group.cell_text + ": ";
    name += group.model_text + ", " + group.solver_text;
    table.row({name, spread_cell(mean(group, "solve_s"), 3), spread_cell(mean(group, "processor_s"), 3)});
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

std::vector<CsvDescription> study_file_columns() {
  return {mean_columns().describe("summary.csv"), pair_columns().describe("pairs.csv"),
          consistency_columns().describe("consistency.csv"), mean_columns().describe("timing.csv"),
          trial_columns({}).describe("trials.csv")};
}

}  // namespace tandem
