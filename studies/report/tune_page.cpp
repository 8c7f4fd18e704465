#include <fmt/format.h>
#include <fmt/ranges.h>

#include <tandem/studies/report/html_page.hpp>
#include <tandem/studies/report/plot_parts.hpp>
#include <tandem/studies/report/plotly_library.hpp>
#include <tandem/studies/report/tune_page.hpp>
#include <tandem/studies/tuning/model_settings.hpp>
#include <tandem/studies/tuning/tune_report.hpp>

namespace tandem {
namespace {

/// Returns the figure of one component of a sensor before and after tuning; `after` may be null.
HtmlFigure residual_figure(const Misfit& before, const Misfit* after, bool named) {
  plot::Json traces = plot::Json::array();
  traces.push_back(plot::line("given model", before.t, before.value, plot::kGrey));
  if (after) traces.push_back(plot::line("tuned model", after->t, after->value, plot::colour(0)));
  return {(named ? before.scenario + ": " : "") + before.parameter,
          "Residuals in expected standard deviations; white with standard deviation 1 if the model is right.", traces,
          plot::layout("time [s]", "residual / σ"), 300};
}

const Misfit* counterpart(const Misfit& before, const std::vector<Misfit>& after) {
  for (const Misfit& m : after)
    if (m.scenario == before.scenario && m.parameter == before.parameter) return &m;
  return nullptr;
}

}  // namespace

std::string tune_page(const Tuning& tuning) {
  HtmlPage page(fmt::format("Tuning of {}", fmt::join(tuning.scenarios, ", ")));
  page.paragraph(tuned_model(tuning));
  page.code(fmt::format("{}", fmt::join(words_of(tuning.selection.settings), " ")));
  page.heading("Steps");
  std::vector<std::vector<std::string>> rows;
  for (const ModelStep& step : tuning.selection.steps)
    rows.push_back({describe(step.change.settings), fmt::format("{:+.1f}", step.gain.gain),
                    fmt::format("{:.1f}", step.gain.standard_error), std::string(name(step.verdict)),
                    step.why.empty() ? step.change.why : step.why});
  page.table({"change", "gain", "standard error", "verdict", "why"}, rows);
  page.heading("Residuals before and after");
  for (const Misfit& before : tuning.before)
    page.figure(residual_figure(before, counterpart(before, tuning.after), tuning.scenarios.size() > 1));
  return page.text(plotly_library());
}

}  // namespace tandem
