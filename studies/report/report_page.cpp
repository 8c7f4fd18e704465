#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/estimation/estimate_files.hpp>
#include <tandem/studies/navigation_results/navigation_files.hpp>
#include <tandem/studies/report/html_page.hpp>
#include <tandem/studies/report/plot_parts.hpp>
#include <tandem/studies/report/plotly_library.hpp>
#include <tandem/studies/report/report_page.hpp>
#include <tandem/studies/report/run_figures.hpp>
#include <tandem/studies/report/run_page.hpp>
#include <tandem/studies/report/study_figures.hpp>
#include <tandem/studies/study/study_database.hpp>
#include <tandem/studies/study/study_report.hpp>
#include <tandem/studies/study/study_summary.hpp>
#include <tandem/studies/study/trial.hpp>
#include <tandem/studies/study/trial_dive.hpp>
#include <tandem/studies/support/html_text.hpp>
#include <tandem/studies/support/private_folder.hpp>

namespace tandem {
namespace {

constexpr std::size_t kMaxWorstTrials = 10, kMaxFailures = 20, kMaxCurves = 12;

std::string run_page(const std::filesystem::path& folder) {
  const RunRecord run = read_run(folder);
  const std::string scenario = run.summary.value("scenario", "");
  HtmlPage page(scenario.empty() ? folder.filename().string() : scenario);
  add_run(run, page);
  return page.text(plotly_library());
}

RunRecord dive_record(const Study& study, std::size_t trial) {
  const TrialSettings settings = study.settings(study.place(trial));
  NavigationOptions options = dive_navigation(study, settings, nullptr);
  options.covariance = true;
  NavigationStudy of;
  of.scenario = dive_scenario(trial_dive(settings), settings.own);
  of.options = options.ego;
  of.navigation = navigate(*of.scenario.navigation, options);
  of.comparison = compare_with_truth(of.navigation, of.scenario);
  const PrivateFolder folder("report");
  write_navigation(of, folder.path());
  return read_run(folder.path());
}

RunRecord trial_record(const Study& study, std::size_t trial) {
  if (!study.has_target()) return dive_record(study, trial);
  const TrialProblem problem = trial_problem(study, trial);
  const Estimate estimated = estimate(problem.scenario, problem.options, problem.solver, problem.settings.graduated);
  const PrivateFolder folder("report");
  write_results(estimated, problem.scenario, folder.path());
  return read_run(folder.path());
}

std::string trial_text(const Study& study, std::size_t trial) {
  const TrialPlace place = study.place(trial);
  const std::string cell = study.cell_text(place);
  return fmt::format("{}{}, seed {}", cell.empty() ? "" : cell + ", ", study.models[place.model], place.replicate);
}

/// Returns the converged trials sorted by a metric, largest first.
std::vector<const TrialResult*> sorted_by_metric(std::string_view metric, const std::vector<TrialResult>& results) {
  std::vector<const TrialResult*> sorted;
  for (const TrialResult& result : results)
    if (result.converged() && result.get(metric)) sorted.push_back(&result);
  std::stable_sort(sorted.begin(), sorted.end(),
                   [&](const TrialResult* a, const TrialResult* b) { return *a->get(metric) > *b->get(metric); });
  return sorted;
}

/// Adds a figure of the cost per iteration for all models and solvers of the seed and cell of a trial.
void add_convergence(const Study& study, std::size_t trial, HtmlPage& page) {
  const std::size_t curves = study.models.size() * study.solvers.size(), first = trial / curves * curves;
  plot::Json traces = plot::Json::array();
  for (std::size_t i = first; i < first + std::min(curves, kMaxCurves); ++i) try {
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
    } catch (const Error&) {  // a rejected trial has no curve
    }
  plot::Json layout = plot::layout("iteration", "cost minus final cost");
  layout["yaxis"]["type"] = "log";
  layout["yaxis"]["exponentformat"] = "power";
  page.figure({"Convergence",
               fmt::format("Cost per iteration for {}, from the standard initial guess.", trial_text(study, first)),
               traces, layout, 380});
}

/// Adds the answer of the study: the least error, how many differences between models are significant, and how many
/// trials converged.
void add_conclusion(const Study& study, const StudyTables& tables, HtmlPage& page) {
  std::size_t converged = 0, compared = 0, significant = 0;
  for (const StudyGroup& group : tables.groups) converged += group.converged;
  for (const StudyPair& pair : tables.pairs) {
    if (pair.metric != rank_metric(study) || pair.base == "raw") continue;
    ++compared;
    significant += pair.ratio.low > 1 || pair.ratio.high < 1;
  }
  std::string text = study_conclusion(study, tables);
  if (compared > 0)
    text += fmt::format(" {} of {} differences from the first model are significant (95 %, paired by seed).",
                        significant, compared);
  text += fmt::format(" {} of {} trials finished, {} converged.", tables.trials, tables.all, converged);
  page.conclusion(converged == tables.all, text);
}

void add_setting(const Study& study, HtmlPage& page) {
  page.heading("Settings");
  std::vector<std::vector<std::string>> rows;
  for (const StudyAxis& axis : study.axes) {
    const std::string& unit = study.parameter(axis.parameter).unit;
    rows.push_back({axis.parameter + (unit.empty() ? "" : fmt::format(" [{}]", unit)),
                    fmt::format("{}", fmt::join(axis.values, ", "))});
  }
  rows.push_back({"models", fmt::format("{}", fmt::join(study.models, ", "))});
  rows.push_back({"solvers", fmt::format("{}", fmt::join(study.solvers, ", "))});
  rows.push_back({"seeds", fmt::format("{}", study.seeds)});
  page.table({"parameter", "values"}, rows);
  page.paragraph(fmt::format("Simulated {}; other parameters have their default values. Hash {:016x}.",
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
  page.heading("Paired comparisons");
  for (const StudyPair& pair : tables.pairs)
    rows.push_back({(pair.group->cell_text.empty() ? "" : pair.group->cell_text + ": ") + pair.group->model_text,
                    pair.base, pair.metric, fmt::format("{:.3f}", pair.ratio.value),
                    fmt::format("{:.3f} … {:.3f}", pair.ratio.low, pair.ratio.high)});
  page.folded_table(
      "Mean error of a model relative to the reference, paired by seed: ratio with its 95 % confidence interval.",
      {"model", "reference", "metric", "ratio", "95 % interval"}, rows);

  if (tables.consistency.empty()) return;
  page.heading("Consistency");
  rows.clear();
  for (const StudyConsistency& row : tables.consistency)
    rows.push_back({(row.group->cell_text.empty() ? "" : row.group->cell_text + ": ") + row.group->model_text,
                    row.metric, fmt::format("{:.2f} / {}", row.mean.value, row.degrees),
                    fmt::format("{:.2f} … {:.2f}", row.low, row.high), row.verdict});
  page.folded_table("Mean NEES and NIS with the 95 % band of a consistent estimator. Each trial counts as one sample.",
                    {"model", "metric", "mean / dof", "95 % band", "verdict"}, rows);
}

void add_worst(const Study& study, const std::vector<TrialResult>& results,
               const std::vector<const TrialResult*>& sorted, HtmlPage& page) {
  page.heading("Worst trials");
  std::vector<std::vector<std::string>> rows;
  for (std::size_t i = 0; i < std::min(kMaxWorstTrials, sorted.size()); ++i)
    rows.push_back({fmt::format("{}", sorted[i]->trial), fmt::format("{:.3f}", *sorted[i]->get(rank_metric(study))),
                    trial_text(study, sorted[i]->trial)});
  const bool rendezvous = study.settings(study.place(0)).rendezvous.has_value();
  page.table({"trial", rendezvous ? "least distance from the docked position [m]" : "mean error [m]", "settings"},
             rows);
  if (!rendezvous) {
    page.paragraph("This command writes a trial as a scenario folder:");
    page.code("tandem study trial STUDY-FOLDER NUMBER --out trial");
  }
  rows.clear();
  std::size_t failures = 0;
  for (const TrialResult& result : results)
    if (!result.converged() && ++failures <= kMaxFailures)
      rows.push_back({fmt::format("{}", result.trial), result.status, trial_text(study, result.trial), result.message});
  if (failures == 0) return;
  page.paragraph(fmt::format("{} trials did not converge or were rejected; means exclude them{}:", failures,
                             failures > kMaxFailures ? fmt::format(". The first {}", kMaxFailures) : ""));
  page.table({"trial", "status", "settings", "reason"}, rows);
}

std::string study_page(const std::filesystem::path& folder) {
  const StudyDatabase database = StudyDatabase::read(folder);
  const Study& study = database.study();
  const std::vector<TrialResult> results = database.results();
  const StudyTables tables = study_tables(study, results);
  HtmlPage page(study.name);
  if (!study.question.empty()) page.paragraph(study.question);
  add_conclusion(study, tables, page);
  add_tables(study, tables, page);
  page.heading("Figures");
  for (const HtmlFigure& figure : study_figures(study, tables)) page.figure(figure);
  add_comparisons(tables, page);
  add_setting(study, page);

  const std::vector<const TrialResult*> sorted = sorted_by_metric(rank_metric(study), results);
  if (sorted.empty()) return page.text(plotly_library());
  const std::size_t middle = sorted[sorted.size() / 2]->trial;
  const TrialSettings settings = study.settings(study.place(middle));
  if (!settings.rendezvous && settings.window == 0) {
    if (study.has_target()) add_convergence(study, middle, page);
    for (const auto& [name, trial] : {std::pair{"median", middle}, {"largest", sorted.front()->trial}}) {
      page.heading(fmt::format("Trial with the {} error: {}", name, trial));
      page.paragraph(trial_text(study, trial));
      add_run(trial_record(study, trial), page);
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
  throw Error(fmt::format("{} is neither a study folder nor an output folder of tandem estimate, navigate or track",
                          folder.string()));
}

std::vector<HtmlFigure> report_figures(const std::filesystem::path& folder) {
  if (!is_run(folder))
    throw Error(
        fmt::format("{} is not an output folder of tandem estimate, navigate or track, whose figures --plots "
                    "draws; tandem study export draws those of a study",
                    folder.string()));
  return figures_of(read_run(folder));
}

}  // namespace tandem
