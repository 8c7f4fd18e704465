#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <stdlib.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/estimation/estimate_files.hpp>
#include <tandem/studies/navigation/more/navigation_files.hpp>
#include <tandem/studies/report/html_page.hpp>
#include <tandem/studies/report/plot_parts.hpp>
#include <tandem/studies/report/plotly_library.hpp>
#include <tandem/studies/report/report_page.hpp>
#include <tandem/studies/report/run_figures.hpp>
#include <tandem/studies/report/study_figures.hpp>
#include <tandem/studies/study/study_database.hpp>
#include <tandem/studies/study/study_report.hpp>
#include <tandem/studies/study/trial.hpp>
#include <tandem/studies/study/trial_dive.hpp>

namespace tandem {
namespace {

constexpr std::size_t kWorst = 10, kMostFailures = 20, kMostCurves = 12;

void add_run(const RunRecord& run, HtmlPage& page) {
  for (const HtmlFigure& figure : run_figures(run)) page.figure(figure);
}

std::string run_page(const std::filesystem::path& folder) {
  const RunRecord run = read_run(folder);
  HtmlPage page(run.scenario.empty() ? folder.filename().string() : run.scenario);
  std::string what;
  for (const std::string& word : {run.model, run.solver, run.status})
    if (!word.empty()) what += (what.empty() ? "" : ", ") + word;
  page.paragraph(what);
  if (!run.table.empty()) {
    page.heading("Errors");
    if (run.has_target()) {
      page.paragraph(
          "Of the target relative to the chaser, mean ± standard deviation over keyframes, by what was "
          "measured there; raw: of the measurement itself.");
      page.table({"keyframes", "n", "position [m]", "orientation [°]", "raw position [m]"}, run.table);
    } else {
      page.paragraph("Of the chaser, mean over keyframes.");
      page.table({"keyframes", "n", "position [m]", "orientation [°]"}, run.table);
    }
  }
  page.heading("Figures");
  add_run(run, page);
  return page.text(plotly_library());
}

/// A folder that is gone with it.
class PassingFolder {
 public:
  PassingFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "tandem-report-XXXXXX").string();
    if (!mkdtemp(name.data())) throw Error(fmt::format("{} cannot be made, which a report needs", name));
    path_ = name;
  }
  ~PassingFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  PassingFolder(const PassingFolder&) = delete;
  PassingFolder& operator=(const PassingFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

RunRecord run_of_dive(const Study& study, std::size_t trial) {
  const TrialSettings settings = study.settings(study.place(trial));
  NavigationOptions options = dive_navigation(study, settings, nullptr);
  options.covariance = true;
  NavigationStudy of;
  of.scenario = dive_scenario(trial_dive(settings), settings.own);
  of.options = options.ego;
  of.navigation = navigate(*of.scenario.navigation, options);
  of.comparison = compare_with_truth(of.navigation, of.scenario);
  const PassingFolder folder;
  write_navigation(of, folder.path());
  return read_run(folder.path());
}

RunRecord run_of_trial(const Study& study, std::size_t trial) {
  if (!study.has_target()) return run_of_dive(study, trial);
  const TrialProblem problem = trial_problem(study, trial);
  const Estimate estimated = estimate(problem.scenario, problem.options, problem.solver, problem.settings.graduated);
  const PassingFolder folder;
  write_results(estimated, problem.scenario, folder.path());
  return read_run(folder.path());
}

std::string place_of(const Study& study, std::size_t trial) {
  const TrialPlace place = study.place(trial);
  const std::string cell = study.cell_text(place);
  return fmt::format("{}{}, seed {}", cell.empty() ? "" : cell + ", ", study.models[place.model], place.replicate);
}

/// Converged trials by the study's rank_metric(), the largest first.
std::vector<const TrialResult*> by_error(std::string_view metric, const std::vector<TrialResult>& results) {
  std::vector<const TrialResult*> sorted;
  for (const TrialResult& result : results)
    if (result.converged() && result.get(metric)) sorted.push_back(&result);
  std::stable_sort(sorted.begin(), sorted.end(),
                   [&](const TrialResult* a, const TrialResult* b) { return *a->get(metric) > *b->get(metric); });
  return sorted;
}

/// How the cost falls, of the trials of one seed and cell.
void add_convergence(const Study& study, std::size_t trial, HtmlPage& page) {
  const std::size_t curves = study.models.size() * study.solvers.size(), first = trial / curves * curves;
  plot::Json traces = plot::Json::array();
  for (std::size_t i = first; i < first + std::min(curves, kMostCurves); ++i) try {
      TrialProblem problem = trial_problem(study, i);
      std::vector<double> iteration, cost;
      common(problem.solver).progress = [&](const Progress& p) {
        iteration.push_back(p.iteration);
        cost.push_back(p.cost);
      };
      const Estimate estimated =
          estimate(problem.scenario, problem.options, problem.solver, problem.settings.graduated);
      for (double& c : cost) c = c > estimated.summary.cost ? c - estimated.summary.cost : std::nan("");
      const TrialPlace place = study.place(i);
      const std::string name = study.solvers.size() > 1
                                   ? fmt::format("{}, {}", study.models[place.model], study.solvers[place.solver])
                                   : study.models[place.model];
      traces.push_back(plot::line(html_escaped(name), iteration, cost, plot::colour(i - first)));
    } catch (const Error&) {  // refused: no curve
    }
  plot::Json layout = plot::layout("iteration", "cost above its end");
  layout["yaxis"]["type"] = "log";
  layout["yaxis"]["exponentformat"] = "power";
  page.figure(
      {"Convergence", fmt::format("Of {}, from the standard start.", place_of(study, first)), traces, layout, 380});
}

void add_setting(const Study& study, HtmlPage& page) {
  page.heading("Setting");
  std::vector<std::vector<std::string>> rows;
  for (const StudyAxis& axis : study.axes) {
    const std::string& unit = study.parameter(axis.parameter).unit;
    rows.push_back({axis.parameter + (unit.empty() ? "" : fmt::format(" [{}]", unit)),
                    fmt::format("{}", fmt::join(axis.values, ", "))});
  }
  rows.push_back({"models", fmt::format("{}", fmt::join(study.models, ", "))});
  rows.push_back({"solvers", fmt::format("{}", fmt::join(study.solvers, ", "))});
  rows.push_back({"seeds", fmt::format("{}", study.seeds)});
  page.table({"what", "values"}, rows);
  page.paragraph(fmt::format("Simulated {}; all other parameters have their defaults. Hash {:016x}.",
                             study.settings(study.place(0)).rendezvous ? "rendezvous"
                             : study.simulation == Simulated::dive     ? "dives"
                                                                       : "dockings",
                             study.hash()));
}

void add_tables(const Study& study, const StudyTables& tables, HtmlPage& page) {
  page.heading("Errors");
  page.paragraph(study_columns_text(study));
  const std::vector<StudyColumn> columns = study_columns(tables);
  std::vector<std::string> head = {"model"};
  for (const StudyColumn& column : columns) head.emplace_back(column.head);
  head.insert(head.end(), {"trials", "converged"});
  const bool raw = std::any_of(columns.begin(), columns.end(), [](const StudyColumn& column) { return column.raw; });
  const auto cell_of = [&](const StudyGroup& group, const StudyColumn& column) {
    for (const StudyMean& mean : tables.means)
      if (mean.group == &group && mean.metric == column.metric) return mean_text(column, &mean.mean);
    return mean_text(column, nullptr);
  };
  std::vector<std::vector<std::string>> rows;
  for (const StudyGroup& group : tables.groups) {
    const std::string cell = group.cell_text.empty() ? "" : group.cell_text + ": ";
    if (raw && group.model == 0 && group.solver == 0) {
      std::vector<std::string>& row = rows.emplace_back(std::vector{cell + "raw"});
      for (const StudyColumn& column : columns)
        row.push_back(column.raw ? cell_of(group, {column.raw, nullptr, "", column.decimals}) : "–");
      row.resize(head.size());
    }
    std::vector<std::string> row = {cell + group.model_text +
                                    (study.solvers.size() > 1 ? ", " + group.solver_text : "")};
    for (const StudyColumn& column : columns) row.push_back(cell_of(group, column));
    row.push_back(fmt::format("{}", group.trials));
    row.push_back(fmt::format("{}", group.converged));
    rows.push_back(std::move(row));
  }
  page.table(head, rows);
}

void add_comparisons(const StudyTables& tables, HtmlPage& page) {
  std::vector<std::vector<std::string>> rows;
  page.heading("Comparisons on the same noise");
  for (const StudyPair& pair : tables.pairs)
    rows.push_back({(pair.group->cell_text.empty() ? "" : pair.group->cell_text + ": ") + pair.group->model_text,
                    pair.base, pair.metric, fmt::format("{:.3f}", pair.ratio.value),
                    fmt::format("{:.3f} … {:.3f}", pair.ratio.low, pair.ratio.high)});
  page.folded_table(
      "How many times the other's error a model's is: ratio of the means with its 95 % interval, seed by seed.",
      {"model", "against", "error", "ratio", "95 % interval"}, rows);

  if (tables.consistency.empty()) return;
  page.heading("Consistency");
  rows.clear();
  for (const StudyConsistency& row : tables.consistency)
    rows.push_back({(row.group->cell_text.empty() ? "" : row.group->cell_text + ": ") + row.group->model_text,
                    row.metric, fmt::format("{:.2f} of {}", row.mean.value, row.degrees),
                    fmt::format("{:.2f} … {:.2f}", row.low, row.high), row.verdict});
  page.folded_table(
      "Whether errors are as large as their covariances say: mean NEES and NIS with the 95 % band of such a mean, a "
      "trial "
      "counting as one sample.",
      {"model", "squared error", "mean", "95 % band", "verdict"}, rows);
}

void add_worst(const Study& study, const std::vector<TrialResult>& results,
               const std::vector<const TrialResult*>& sorted, HtmlPage& page) {
  page.heading("The worst trials");
  std::vector<std::vector<std::string>> rows;
  for (std::size_t i = 0; i < std::min(kWorst, sorted.size()); ++i)
    rows.push_back({fmt::format("{}", sorted[i]->trial), fmt::format("{:.3f}", *sorted[i]->get(rank_metric(study))),
                    place_of(study, sorted[i]->trial)});
  const bool rendezvous = study.settings(study.place(0)).rendezvous.has_value();
  page.table({"trial", rendezvous ? "least distance from the docked position [m]" : "mean error [m]", "what"}, rows);
  if (!rendezvous) {
    page.paragraph("Each can be had as a scenario folder, to be estimated again:");
    page.code("tandem study trial FOLDER-OF-THE-STUDY NUMBER --out trial");
  }
  rows.clear();
  std::size_t failures = 0;
  for (const TrialResult& result : results)
    if (!result.converged() && ++failures <= kMostFailures)
      rows.push_back({fmt::format("{}", result.trial), result.status, place_of(study, result.trial), result.message});
  if (failures == 0) return;
  page.paragraph(fmt::format("{} trials did not converge or were refused{}; means are without them:", failures,
                             failures > kMostFailures ? fmt::format(", the first {} of them", kMostFailures) : ""));
  page.table({"trial", "status", "what", "why"}, rows);
}

std::string study_page(const std::filesystem::path& folder) {
  const StudyDatabase database = StudyDatabase::read(folder);
  const Study& study = database.study();
  const std::vector<TrialResult> results = database.results();
  const StudyTables tables = study_tables(study, results);
  HtmlPage page(study.name);
  if (!study.question.empty()) page.paragraph(study.question);
  page.paragraph(fmt::format("{} of {} trials.", tables.trials, tables.all));
  add_setting(study, page);
  add_tables(study, tables, page);
  page.heading("Figures");
  for (const HtmlFigure& figure : study_figures(study, tables)) page.figure(figure);
  add_comparisons(tables, page);

  const std::vector<const TrialResult*> sorted = by_error(rank_metric(study), results);
  if (sorted.empty()) return page.text(plotly_library());
  const std::size_t middle = sorted[sorted.size() / 2]->trial;
  const TrialSettings settings = study.settings(study.place(middle));
  if (!settings.rendezvous && settings.window == 0) {
    if (study.has_target()) add_convergence(study, middle, page);
    for (const auto& [name, trial] : {std::pair{"middle", middle}, {"worst", sorted.front()->trial}}) {
      page.heading(fmt::format("The trial with the {} error: {}", name, trial));
      page.paragraph(place_of(study, trial));
      add_run(run_of_trial(study, trial), page);
    }
  }
  add_worst(study, results, sorted, page);
  return page.text(plotly_library());
}

}  // namespace

std::string report_page(const std::filesystem::path& folder) {
  if (!std::filesystem::is_directory(folder)) throw Error(fmt::format("{} is not a folder", folder.string()));
  if (StudyDatabase::is_in(folder)) return study_page(folder);
  if (is_run(folder)) return run_page(folder);
  throw Error(
      fmt::format("{} is neither a study's folder nor one that tandem estimate, navigate or track --out has written",
                  folder.string()));
}

}  // namespace tandem
