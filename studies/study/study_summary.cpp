#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include <fmt/format.h>

#include <tandem/studies/study/study_report.hpp>
#include <tandem/studies/study/study_summary.hpp>
#include <tandem/studies/support/json_fields.hpp>
#include <tandem/studies/support/text_table.hpp>

namespace tandem {
namespace {

using Align = TextTable::Align;

constexpr std::size_t kMaxMeans = 16, kMaxPairs = 8, kMaxMetrics = 8;  // rows of the tables
constexpr std::size_t kMaxColumns = 4;                                 // metrics of the table of means

const Interval* mean_of(const StudyTables& tables, const StudyGroup& group, std::string_view metric) {
  for (const StudyMean& mean : tables.means)
    if (mean.group == &group && mean.metric == metric) return &mean.mean;
  return nullptr;
}

std::string name_of(const Study& study, const StudyGroup& group) {
  return study.solvers.size() > 1 ? group.model_text + ", " + group.solver_text : group.model_text;
}

/// Returns "… and 12 more", or nothing.
std::string more(std::size_t all, std::size_t shown) {
  return all > shown ? fmt::format("… and {} more\n", all - shown) : "";
}

std::string means_table(const Study& study, const StudyTables& tables) {
  std::vector<StudyColumn> columns = study_columns(tables);
  if (columns.size() > kMaxColumns) columns.resize(kMaxColumns);
  std::vector<TextTable::Column> heads = {{"cell", Align::left}, {"model", Align::left}};
  for (const StudyColumn& column : columns) heads.push_back({column.head});
  heads.push_back({"converged"});
  TextTable table(heads);
  for (std::size_t i = 0; i < std::min(kMaxMeans, tables.groups.size()); ++i) {
    const StudyGroup& group = tables.groups[i];
    std::vector<std::string> cells = {group.cell_text, name_of(study, group)};
    for (const StudyColumn& column : columns) cells.push_back(mean_text(column, mean_of(tables, group, column.metric)));
    cells.push_back(fmt::format("{} of {}", group.converged, group.trials));
    table.row(cells);
  }
  return "\n" + table.str() + more(tables.groups.size(), kMaxMeans);
}

/// Returns the comparisons with the largest differences that are significant.
std::string pairs_table(const Study& study, const StudyTables& tables) {
  if (tables.pairs.empty()) return "";
  std::vector<const StudyPair*> significant;
  for (const StudyPair& pair : tables.pairs)
    if (pair.ratio.low > 1 || pair.ratio.high < 1) significant.push_back(&pair);
  std::stable_sort(significant.begin(), significant.end(), [](const StudyPair* a, const StudyPair* b) {
    return std::abs(std::log(a->ratio.value)) > std::abs(std::log(b->ratio.value));
  });
  TextTable table({{"largest differences", Align::left},
                   {"relative to", Align::left},
                   {"metric", Align::left},
                   {"ratio"},
                   {"95 % interval"}});
  for (std::size_t i = 0; i < std::min(kMaxPairs, significant.size()); ++i) {
    const StudyPair& pair = *significant[i];
    const std::string& cell = pair.group->cell_text;
    table.row({cell.empty() ? name_of(study, *pair.group) : cell + ": " + name_of(study, *pair.group), pair.base,
               pair.metric, fmt::format("{:.3f}", pair.ratio.value),
               fmt::format("{:.3f} … {:.3f}", pair.ratio.low, pair.ratio.high)});
  }
  return fmt::format("\n{} of {} paired comparisons differ significantly (95 %).\n", significant.size(),
                     tables.pairs.size()) +
         (significant.empty() ? "" : table.str() + more(significant.size(), kMaxPairs));
}

/// Returns the number of consistent, optimistic and pessimistic groups by metric.
std::string consistency_table(const StudyTables& tables) {
  if (tables.consistency.empty()) return "";
  std::vector<std::string> metrics;
  struct Count {
    int consistent = 0, optimistic = 0, pessimistic = 0;
    double least = INFINITY, largest = 0;
  };
  std::map<std::string, Count> counts;
  for (const StudyConsistency& row : tables.consistency) {
    if (std::find(metrics.begin(), metrics.end(), row.metric) == metrics.end()) metrics.push_back(row.metric);
    Count& count = counts[row.metric];
    ++(row.verdict.starts_with("optimistic")    ? count.optimistic
       : row.verdict.starts_with("pessimistic") ? count.pessimistic
                                                : count.consistent);
    count.least = std::min(count.least, row.sigma_factor);
    count.largest = std::max(count.largest, row.sigma_factor);
  }
  TextTable table(
      {{"consistency", Align::left}, {"consistent"}, {"optimistic"}, {"pessimistic"}, {"actual error / stated σ"}});
  for (std::size_t i = 0; i < std::min(kMaxMetrics, metrics.size()); ++i) {
    const Count& count = counts[metrics[i]];
    table.row({metrics[i], fmt::format("{}", count.consistent), fmt::format("{}", count.optimistic),
               fmt::format("{}", count.pessimistic), fmt::format("{:.2f} … {:.2f}", count.least, count.largest)});
  }
  return "\n" + table.str() + more(metrics.size(), kMaxMetrics);
}

std::string times_line(const StudyTables& tables) {
  const StudyMean *fastest = nullptr, *slowest = nullptr;
  for (const StudyMean& time : tables.times) {
    if (time.metric != "solve_s") continue;
    if (!fastest || time.mean.value < fastest->mean.value) fastest = &time;
    if (!slowest || time.mean.value > slowest->mean.value) slowest = &time;
  }
  if (!fastest) return "";
  return fmt::format("\nMean solve time of a trial: {:.3f} s to {:.3f} s.\n", fastest->mean.value, slowest->mean.value);
}

struct Document {
  const Study& study;
  const StudyTables& tables;
  const std::string& folder;
};

/// Adds cell, model, solver and metric of a row.
template <class Row>
JsonFields<Row> row_fields() {
  return JsonFields<Row>()
      .add("cell", "grid cell: values of the parameters that vary", [](const Row& r) { return r.group->cell_text; })
      .add("model", "motion model and constraints", [](const Row& r) { return r.group->model_text; })
      .add("solver", "name of the solver in the study file", [](const Row& r) { return r.group->solver_text; })
      .add("metric", "column of trials.csv", [](const Row& r) { return r.metric; });
}

JsonFields<StudyGroup> group_fields() {
  using G = StudyGroup;
  return JsonFields<G>()
      .add("cell", "grid cell: values of the parameters that vary", [](const G& g) { return g.cell_text; })
      .add("model", "motion model and constraints", [](const G& g) { return g.model_text; })
      .add("solver", "name of the solver in the study file", [](const G& g) { return g.solver_text; })
      .add("trials", "number of finished trials", [](const G& g) { return g.trials; })
      .add("converged", "number of converged trials", [](const G& g) { return g.converged; });
}

JsonFields<StudyMean> mean_fields() {
  using M = StudyMean;
  return row_fields<M>()
      .add("n", "number of converged trials with this metric", [](const M& m) { return m.mean.n; })
      .add("mean", "mean over these trials", [](const M& m) { return m.mean.value; })
      .add("low", "lower limit of the 95 % confidence interval", [](const M& m) { return m.mean.low; })
      .add("high", "upper limit of the 95 % confidence interval", [](const M& m) { return m.mean.high; });
}

JsonFields<StudyPair> pair_fields() {
  using P = StudyPair;
  return row_fields<P>()
      .add("against", "reference: raw measurements, or the first model of the study", [](const P& p) { return p.base; })
      .add("n", "number of seeds on which both converged", [](const P& p) { return p.ratio.n; })
      .add("ratio", "mean of the model divided by the mean of the reference", [](const P& p) { return p.ratio.value; })
      .add("low", "lower limit of the 95 % confidence interval", [](const P& p) { return p.ratio.low; })
      .add("high", "upper limit of the 95 % confidence interval", [](const P& p) { return p.ratio.high; });
}

JsonFields<StudyConsistency> consistency_fields() {
  using C = StudyConsistency;
  return row_fields<C>()
      .add("degrees", "degrees of freedom: the expected mean of a consistent estimator",
           [](const C& c) { return c.degrees; })
      .add("n", "number of trials", [](const C& c) { return c.mean.n; })
      .add("mean", "mean over trials: ANEES, or mean NIS", [](const C& c) { return c.mean.value; })
      .add("sigma_factor", "ratio of the actual errors to the stated σ", [](const C& c) { return c.sigma_factor; })
      .add("verdict", "consistent; or optimistic (σ too small) or pessimistic (σ too large) by a factor",
           [](const C& c) { return c.verdict; });
}

JsonFields<Document> document_fields() {
  using D = Document;
  return JsonFields<D>()
      .add("name", "name of the study", [](const D& d) { return d.study.name; })
      .add("question", "question of the study", [](const D& d) { return d.study.question; })
      .add("folder", "folder of the study", [](const D& d) { return d.folder; })
      .add("hash", "hash of the settings, hexadecimal",
           [](const D& d) { return fmt::format("{:016x}", d.study.hash()); })
      .add("trials", "number of trials of the study", [](const D& d) { return d.tables.all; })
      .add("finished", "number of finished trials", [](const D& d) { return d.tables.trials; })
      .add_list("groups", "combinations of cell, model and solver", group_fields(),
                [](const D& d) -> const std::vector<StudyGroup>& { return d.tables.groups; })
      .add_list("means", "means of all metrics, as in summary.csv", mean_fields(),
                [](const D& d) -> const std::vector<StudyMean>& { return d.tables.means; })
      .add_list("pairs", "paired comparisons, as in pairs.csv", pair_fields(),
                [](const D& d) -> const std::vector<StudyPair>& { return d.tables.pairs; })
      .add_list("consistency", "consistency of errors and covariances, as in consistency.csv", consistency_fields(),
                [](const D& d) -> const std::vector<StudyConsistency>& { return d.tables.consistency; });
}

}  // namespace

std::string study_conclusion(const Study& study, const StudyTables& tables) {
  const std::string_view metric = rank_metric(study);
  std::map<std::string, std::size_t> wins;
  std::size_t cells = 0;
  const StudyGroup *least = nullptr, *largest = nullptr;
  const auto value = [&](const StudyGroup* group) { return mean_of(tables, *group, metric)->value; };
  for (std::size_t cell = 0; cell < study.cells(); ++cell) {
    const StudyGroup* best = nullptr;
    std::size_t compared = 0;
    for (const StudyGroup& group : tables.groups) {
      if (group.cell != cell || !mean_of(tables, group, metric)) continue;
      ++compared;
      if (!best || value(&group) < value(best)) best = &group;
      if (!least || value(&group) < value(least)) least = &group;
      if (!largest || value(&group) > value(largest)) largest = &group;
    }
    if (compared < 2) continue;
    ++cells;
    ++wins[name_of(study, *best)];
  }
  if (!least) return fmt::format("No trial has a value of {}.", metric);
  const std::string what = trial_metrics()[metric_index(metric)].doc;
  if (cells == 0)
    return least == largest ? fmt::format("{}: {:.3g} ({})", metric, value(least), what)
                            : fmt::format("{}: {:.3g} with {} to {:.3g} with {} ({})", metric, value(least),
                                          least->cell_text, value(largest), largest->cell_text, what);
  const auto winner =
      std::max_element(wins.begin(), wins.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
  const std::string where = cells == 1 ? "" : fmt::format(" in {} of {} cells", winner->second, cells);
  return fmt::format("{} has the least {}{} ({}).", winner->first, metric, where, what);
}

std::string study_summary(const Study& study, const StudyTables& tables) {
  std::size_t converged = 0;
  for (const StudyGroup& group : tables.groups) converged += group.converged;
  return fmt::format("{}{}\n{} of {} trials, {} converged\n", study.name,
                     study.question.empty() ? "" : ": " + study.question, tables.trials, tables.all, converged) +
         study_conclusion(study, tables) + "\n" + means_table(study, tables) + pairs_table(study, tables) +
         consistency_table(tables) + times_line(tables);
}

std::string study_json(const Study& study, const StudyTables& tables, const std::string& folder) {
  return json_text(json_document("study", document_fields(), Document{study, tables, folder}));
}

FileDescription study_json_keys() { return describe_json("--json show", "study", document_fields()); }

}  // namespace tandem
