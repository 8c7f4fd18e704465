#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <tandem/lie/error.hpp>
#include <tandem/problem/quantile.hpp>
#include <tandem/studies/report/run_figures.hpp>
#include <tandem/studies/report/run_page.hpp>

namespace tandem {
namespace {

using Json = nlohmann::ordered_json;
using Rows = std::vector<std::vector<std::string>>;

constexpr const char* kDash = "–";
constexpr std::size_t kMaxRemarks = 5;  // of one kind

const Json& part(const Json& of, const char* key) {
  static const Json empty = Json::object();
  return of.contains(key) ? of[key] : empty;
}

std::string count_text(const Json& of, const char* key) {
  return of.contains(key) ? fmt::format("{:.0f}", of[key].get<double>()) : kDash;
}

/// Returns a number, or a dash if there is none.
std::string number_text(const Json& of, const char* key, fmt::format_string<double> format) {
  if (!of.contains(key) || !of[key].is_number()) return kDash;
  return fmt::format(format, of[key].get<double>());
}

/// Returns a sentence if the errors against the truth contradict the stated standard deviations, else nothing.
std::string overconfidence(const RunRecord& run) {
  constexpr double kMostNees = 27;  // mean NEES of a position with three times too small standard deviations
  const Json& all = part(part(run.summary, "errors"), "all");
  const double nees =
      run.summary.value("overconfident_nees", all.value("position_nees", all.value("position_nees_mean", 0.0)));
  if (!(nees > kMostNees)) return "";
  return fmt::format(
      " The errors against the truth are larger than stated: their mean NEES is {:.0f}, 3 if consistent.", nees);
}

void add_conclusion(const RunRecord& run, HtmlPage& page) {
  const Json& s = run.summary;
  if (!run.is_online()) {
    const Json& fit = part(s, "fit");
    const bool converged = s.value("status", "") == "converged";
    std::string text = fit.value("verdict", "");
    if (!converged)
      text = fmt::format("The solve ended as {}: {}. {}", s.value("status", ""), s.value("message", ""), text);
    const std::string errors = overconfidence(run);
    page.conclusion(
        converged && errors.empty() && fit.value("consistent", true) && !fit.value("noise_far_too_large", false),
        text + errors);
    return;
  }
  const auto n = [&](const char* key) { return s.value(key, 0); };
  int used = 0, rejected = 0;
  for (const Json& sensor : part(s, "sensors"))
    used += sensor.value("used", 0), rejected += sensor.value("rejected", 0);
  const bool reliable = !s.contains("unreliable");
  std::string text = reliable ? "The track was reliable throughout"
                              : fmt::format("The track was unreliable from {} to {}",
                                            time_axis(run).text(s["unreliable"].value("since", 0.0) - run.start),
                                            time_axis(run).text(s["unreliable"].value("until", 0.0) - run.start));
  text += fmt::format(": {} of {} updates converged, {} of {} measurements were rejected, {} resets, {} suspensions.",
                      n("updates") - n("not_converged"), n("updates"), rejected, used + rejected, n("resets"),
                      n("suspensions"));
  const std::string errors = overconfidence(run);
  page.conclusion(reliable && errors.empty() && n("resets") == 0 && rejected <= used / 10, text + errors);
}

void add_facts(const RunRecord& run, HtmlPage& page) {
  const Json& s = run.summary;
  std::vector<std::string> facts;
  if (const std::string model = s.value("model", ""); !model.empty()) facts.push_back(model);
  if (s.contains("mode")) facts.push_back("mode " + s.value("mode", ""));
  if (s.contains("solver"))
    facts.push_back(fmt::format("{}, {} after {} iterations", s.value("solver", ""), s.value("status", ""),
                                s.value("iterations", 0)));
  facts.push_back(fmt::format("{} keyframes", s.value("keyframes", 0)));
  const plot::TimeAxis duration(0, run.duration());
  facts.push_back(duration.text(run.duration()) + " h:min:s");
  if (const std::string start = time_axis(run).start_text(); !start.empty()) facts.back() += " from " + start;
  facts.push_back(run.is_ned ? "axes north, east, down" : "z axis up");
  page.paragraph(fmt::format("{}.", fmt::join(facts, "; ")));
}

/// Adds what the command found in the data.
void add_remarks(const RunRecord& run, HtmlPage& page) {
  const Json& s = run.summary;
  const plot::TimeAxis time = time_axis(run);
  std::vector<std::string> remarks;
  const auto add = [&](const char* key, const auto& text_of) {
    const Json& all = part(s, key);
    std::size_t n = 0;
    for (const Json& one : all)
      if (++n <= kMaxRemarks) remarks.push_back(text_of(one));
    if (n > kMaxRemarks) remarks.back() += fmt::format(" (and {} more)", n - kMaxRemarks);
  };
  add("findings", [](const Json& text) { return text.get<std::string>(); });
  add("likely_causes", [](const Json& cause) {
    return fmt::format("{}: {}: the cost of a part of the recording would fall from {} to {}.",
                       cause.value("sensor", ""), cause.value("text", ""), number_text(cause, "cost_before", "{:.4g}"),
                       number_text(cause, "cost_after", "{:.4g}"));
  });
  if (const Json& suspects = part(s, "suspects"); !suspects.empty()) {
    std::vector<std::string> worst;
    for (const Json& suspect : suspects)
      if (worst.size() < kMaxRemarks)
        worst.push_back(fmt::format("{} at {} ({} σ)", suspect.value("sensor", ""),
                                    time.text(suspect.value("t", 0.0) - run.start),
                                    number_text(suspect, "sigmas", "{:.0f}")));
    remarks.push_back(fmt::format("Measurements that contradict the others: {}. The worst: {}.", suspects.size(),
                                  fmt::join(worst, ", ")));
  }
  add("splits", [&](const Json& gap) {
    return fmt::format("The IMU has a gap from {} to {}.", time.text(gap.at(0).get<double>() - run.start),
                       time.text(gap.at(1).get<double>() - run.start));
  });
  add("rejected_lines", [](const Json& of) {
    return fmt::format("{}: {} lines rejected: {}.", of.value("sensor", ""), count_text(of, "lines"),
                       of.value("why", ""));
  });
  for (const auto& [key, format] : {std::pair{"unobservable", "Unobservable: {}."},
                                    {"contradiction", "{}"},
                                    {"unmeasured_orientation", "{}"},
                                    {"truth_aligned", "{}"},
                                    {"no_covariance", "No standard deviations: {}."}})
    if (s.contains(key) && s[key].is_string())
      remarks.push_back(fmt::format(fmt::runtime(format), s[key].get<std::string>()));
  page.list(remarks);
}

/// Returns the rows of a sensor in the table of the fit, one for each component.
void add_fit_rows(const RunRecord& run, const std::string& name, const Json& fit, Rows& rows) {
  const Json& use = part(part(run.summary, "sensors"), name.c_str());
  const Json& worst = part(fit, "worst");
  std::vector<std::string> row = {
      name,
      count_text(fit, "used"),
      count_text(fit, "rejected"),
      fmt::format("{} ({})", count_text(fit, "down_weighted"), number_text(fit, "expected_down_weighted", "{:.0f}")),
      count_text(use, "held_out"),
      count_text(use, "discarded")};
  std::string largest = kDash;
  if (!worst.empty())
    largest = fmt::format("{:+.1f} ({}) at {}", worst[0].value("residual", 0.0), worst[0].value("component", ""),
                          time_axis(run).text(worst[0].value("t", 0.0) - run.start));
  for (const auto& [component, of] : part(fit, "components").items()) {
    row.insert(row.end(), {component, number_text(of, "mean", "{:+.2f}"), number_text(of, "sigma", "{:.2f}"),
                           number_text(of, "correlation", "{:.2f}"), largest});
    rows.push_back(std::move(row));
    row.assign(6, "");
    largest.clear();
  }
}

void add_fit(const RunRecord& run, HtmlPage& page) {
  if (run.is_online()) {
    Rows rows;
    for (const Json& sensor : part(run.summary, "sensors"))
      rows.push_back({sensor.value("sensor", ""), count_text(sensor, "used"), count_text(sensor, "rejected")});
    page.heading("Sensors");
    page.table({"sensor", "used", "rejected"}, rows);
    return;
  }
  Rows rows;
  for (const auto& [name, fit] : part(part(run.summary, "fit"), "sensors").items())
    if (fit.value("used", 0) + fit.value("rejected", 0) > 0) add_fit_rows(run, name, fit, rows);
  if (rows.empty()) return;
  page.heading("Fit by sensor");
  page.paragraph(
      "Residuals in expected standard deviations: mean 0, σ 1 and correlation 0 if the noise is as stated. In "
      "brackets: "
      "number expected to be down-weighted.");
  page.table({"sensor", "used", "rejected", "down-weighted", "held out", "discarded", "component", "mean", "σ",
              "lag-1 corr.", "largest residual"},
             rows);
}

void add_coverage(const RunRecord& run, HtmlPage& page) {
  Rows rows;
  for (const auto& [name, c] : part(run.summary, "held_out").items())
    rows.push_back({name, count_text(c, "n"), count_text(c, "inliers"),
                    number_text(c, "inlier_rows_in_95_percent", "{:.1f}"),
                    number_text(c, "inliers_in_95_percent", "{:.1f}")});
  if (rows.empty()) return;
  page.heading("Held-out measurements");
  page.paragraph(
      "Share of the held-out measurements within the 95 % intervals that the others predict: 95 % if the "
      "stated standard deviations are right.");
  page.table({"sensor", "n", "inliers", "components within 95 % [%]", "measurements within 95 % [%]"}, rows);
}

void add_uncertainty(const RunRecord& run, HtmlPage& page) {
  Rows rows;
  for (const auto& [curves, unit] : {std::pair{&run.position_sigma, "m"}, {&run.rotation_sigma, "°"}})
    for (const RunRecord::Curve& curve : *curves) {
      std::vector<double> known = curve.value;
      std::erase_if(known, [](double v) { return !std::isfinite(v); });
      const auto text = [&, unit = unit](double share) {
        return fmt::format("{:.3g} {}", detail::quantile(known, share), unit);
      };
      rows.push_back({curve.name, text(0.5), text(0.95), text(1)});
    }
  if (rows.empty()) return;
  page.heading("Uncertainty");
  page.paragraph("Standard deviations over the keyframes.");
  page.table({"state", "median", "95 % below", "largest"}, rows);
}

std::string mean_std_text(const Json& of, const std::string& key, const std::string& unit) {
  const std::string mean = key + "_mean_" + unit, std = key + "_std_" + unit;
  const std::string text = number_text(of, mean.c_str(), "{:.3f}");
  return of.contains(std) ? fmt::format("{} ± {}", text, number_text(of, std.c_str(), "{:.3f}")) : text;
}

void add_errors(const RunRecord& run, HtmlPage& page) {
  if (!run.has_truth()) return;
  const Json& errors = part(run.summary, "errors");
  // As in the table of the command: a mean of raw errors compares only if all keyframes have measurements.
  const bool all_measured = part(errors, "partial").value("n", 0) + part(errors, "none").value("n", 0) == 0;
  Rows rows;
  for (const auto& [type, of] : errors.items()) {
    if (of.value("n", 0) == 0) continue;
    rows.push_back(
        {type, count_text(of, "n"), mean_std_text(of, "position", "m"), mean_std_text(of, "orientation", "deg")});
    if (run.has_target())
      rows.back().push_back(type != "all" || all_measured ? mean_std_text(of, "raw_position", "m") : kDash);
  }
  page.heading("Errors");
  if (run.has_target()) {
    page.paragraph(
        "Errors of the target relative to the chaser, mean ± standard deviation, by the measurement at the keyframe. "
        "Raw: errors of the measurements.");
    page.table({"measurement", "n", "position [m]", "orientation [°]", "raw position [m]"}, rows);
  } else {
    page.paragraph("Errors of the chaser, mean over keyframes.");
    page.table({"keyframes", "n", "position [m]", "orientation [°]"}, rows);
  }
}

void add_systematic_errors(const RunRecord& run, HtmlPage& page) {
  Rows rows;
  for (const auto& [name, of] : part(run.summary, "systematic_errors").items())
    rows.push_back(
        {name, number_text(of, "value", "{:.4g}"), number_text(of, "sigma", "{:.2g}"), of.value("verdict", "")});
  if (rows.empty()) return;
  page.heading("Systematic errors");
  page.table({"name", "estimate", "standard deviation", "verdict"}, rows);
}

/// Returns f(). Throws Error if summary.json has values of unexpected types.
template <class F>
auto unless_damaged(F f) try {
  return f();
} catch (const nlohmann::json::exception&) {
  throw Error("summary.json of the run is damaged or was not written by tandem");
}

}  // namespace

void add_run(const RunRecord& run, HtmlPage& page) {
  unless_damaged([&] {
    add_conclusion(run, page);
    add_facts(run, page);
    add_remarks(run, page);
    add_fit(run, page);
    add_coverage(run, page);
    add_uncertainty(run, page);
    add_errors(run, page);
    add_systematic_errors(run, page);
  });
  page.heading("Figures");
  for (const HtmlFigure& figure : figures_of(run)) page.figure(figure);
}

std::vector<HtmlFigure> figures_of(const RunRecord& run) {
  return unless_damaged([&] { return run_figures(run); });
}

}  // namespace tandem
