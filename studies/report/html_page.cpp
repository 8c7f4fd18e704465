#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <tandem/studies/report/html_page.hpp>
#include <tandem/studies/support/html_text.hpp>

namespace tandem {
namespace {

const char* const kStyle = R"(
:root { color-scheme: light; }
body { font: 16px/1.5 system-ui, "Segoe UI", Roboto, "DejaVu Sans", sans-serif; color: #1c2733; background: #fff;
       max-width: 1160px; margin: 0 auto; padding: 1rem; }
h1 { font-size: 1.7rem; line-height: 1.2; margin: .6em 0 .3em; }
h2 { font-size: 1.25rem; margin: 2em 0 .4em; border-bottom: 1px solid #d6dde5; }
p { margin: .5em 0; max-width: 75ch; }
p.good, p.bad { padding: .6em .8em; border-left: 5px solid #009e73; background: #eaf6f1; }
p.bad { border-color: #d55e00; background: #fbeee5; }
ul { margin: .5em 0; padding-left: 1.2em; max-width: 75ch; }
pre { background: #f2f5f8; padding: .6em .8em; overflow-x: auto; font-size: .85rem; }
/* A table wider than the text uses the window's width, then scrolls beside its first column. */
.wide { overflow-x: auto; width: max-content; min-width: 100%; max-width: calc(100vw - 2.5rem); position: relative;
        left: 50%; transform: translateX(-50%); }
table { border-collapse: collapse; font-size: .88rem; font-variant-numeric: tabular-nums; margin: .6em 0; }
th, td { padding: .25em .7em; text-align: right; white-space: nowrap; border-bottom: 1px solid #e6ebf0; }
th:first-child, td:first-child { text-align: left; position: sticky; left: 0; background: #fff; }
th { border-bottom: 2px solid #9fb0c0; }
summary { cursor: pointer; max-width: 75ch; }
figure { margin: 1.2em 0 2em; break-inside: avoid; }
figcaption { margin-top: .4em; font-size: .9rem; color: #44525f; max-width: 85ch; }
figcaption b { color: #1c2733; }
.plot { width: 100%; }
@media (max-width: 600px) { body { font-size: 15px; padding: .6rem; } th, td { padding: .2em .4em; } }
@media print { body { max-width: none; font-size: 11pt; } a { color: inherit; } .modebar { display: none !important; } }
)";

// Draws figures in or near the viewport first, then the others one by one with pauses that keep scrolling smooth.
// Printing draws all figures at once. The camera button saves a figure as SVG.
const char* const kScript = R"(
(function () {
  const left = new Set(document.querySelectorAll(".plot"));
  const draw = element => {
    if (!left.delete(element)) return;
    const figure = JSON.parse(document.getElementById(element.id + "-data").textContent);
    const axis = figure.layout.xaxis;
    if (axis && axis.type === "date") {  // times are in ms since 1970; Plotly reads numbers as years
      const dates = ms => ms.map(t => t === null ? null : new Date(t).toISOString().slice(0, -1));
      axis.range = dates(axis.range);
      for (const trace of figure.traces) trace.x = dates(trace.x);
    }
    Plotly.newPlot(element, figure.traces, figure.layout, {
      responsive: true, displaylogo: false, displayModeBar: window.innerWidth < 700 ? false : "hover",
      toImageButtonOptions: { format: "svg", filename: element.dataset.name }
    }).then(() => { if (figure.frames.length) Plotly.addFrames(element, figure.frames); });
  };
  const near = new IntersectionObserver(entries => {
    for (const entry of entries) if (entry.isIntersecting) { near.unobserve(entry.target); draw(entry.target); }
  }, { rootMargin: "300px" });
  left.forEach(element => near.observe(element));
  const drawNext = () => { for (const element of left) { draw(element); setTimeout(drawNext, 50); return; } };
  addEventListener("load", () => setTimeout(drawNext, 50));
  addEventListener("beforeprint", () => {
    document.querySelectorAll("details").forEach(d => { d.open = true; });
    left.forEach(draw);
  });
})();
)";

/// Escapes "<", which JSON has only in strings, so that a string cannot end its script element or open a comment.
std::string escaped_for_script(std::string json) {
  for (std::size_t at = 0; (at = json.find('<', at)) != std::string::npos;) json.replace(at, 1, "\\u003c");
  return json;
}

/// Escapes the strings, since Plotly interprets markup in names. Templates have markup of their own.
void escape_markup(nlohmann::ordered_json& json) {
  if (json.is_string()) {
    json = html_escaped(json.get<std::string>());
  } else if (json.is_object()) {
    for (auto& [key, value] : json.items())
      if (key != "hovertemplate") escape_markup(value);
  } else if (json.is_array()) {
    for (auto& value : json) escape_markup(value);
  }
}

std::string json_of(nlohmann::ordered_json json) {
  escape_markup(json);
  return json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

}  // namespace

HtmlFigure::HtmlFigure(std::string title, std::string caption, const nlohmann::ordered_json& traces,
                       const nlohmann::ordered_json& layout, int height, double aspect)
    : title(std::move(title)),
      caption(std::move(caption)),
      traces(json_of(traces)),
      layout(json_of(layout)),
      height(height),
      aspect(aspect) {}

void HtmlFigure::set_frames(const nlohmann::ordered_json& all) { frames = json_of(all); }

void HtmlPage::heading(const std::string& text) { body_ += fmt::format("<h2>{}</h2>\n", html_escaped(text)); }

void HtmlPage::paragraph(const std::string& text) { body_ += fmt::format("<p>{}</p>\n", html_escaped(text)); }

void HtmlPage::conclusion(bool good, const std::string& text) {
  body_ += fmt::format("<p class=\"{}\">{}</p>\n", good ? "good" : "bad", html_escaped(text));
}

void HtmlPage::list(const std::vector<std::string>& items) {
  if (items.empty()) return;
  body_ += "<ul>\n";
  for (const std::string& item : items) body_ += fmt::format("<li>{}</li>\n", html_escaped(item));
  body_ += "</ul>\n";
}

void HtmlPage::code(const std::string& text) { body_ += fmt::format("<pre>{}</pre>\n", html_escaped(text)); }

void HtmlPage::folded_table(const std::string& summary, const std::vector<std::string>& head,
                            const std::vector<std::vector<std::string>>& rows) {
  constexpr std::size_t few = 24;
  body_ += fmt::format("<details{}><summary>{}</summary>\n", rows.size() <= few ? " open" : "", html_escaped(summary));
  table(head, rows);
  body_ += "</details>\n";
}

void HtmlPage::table(const std::vector<std::string>& head, const std::vector<std::vector<std::string>>& rows) {
  body_ += "<div class=\"wide\"><table>\n<tr>";
  for (const std::string& cell : head) body_ += fmt::format("<th>{}</th>", html_escaped(cell));
  body_ += "</tr>\n";
  for (const auto& row : rows) {
    body_ += "<tr>";
    for (const std::string& cell : row) body_ += fmt::format("<td>{}</td>", html_escaped(cell));
    body_ += "</tr>\n";
  }
  body_ += "</table></div>\n";
}

void HtmlPage::figure(const HtmlFigure& figure) {
  const std::string id = fmt::format("figure-{}", ++count_);
  const std::string height = figure.aspect > 0
                                 ? fmt::format("min({}px, {:.0f}vw + 140px)", figure.height, 85 * figure.aspect)
                                 : fmt::format("{}px", figure.height);
  body_ += fmt::format(
      "<figure><div class=\"plot\" id=\"{0}\" data-name=\"{1}\" style=\"height:{2}\"></div>"
      "<figcaption><b>{1}.</b> {3}</figcaption></figure>\n",
      id, html_escaped(figure.title), height, html_escaped(figure.caption));
  figures_ += fmt::format(
      "<script type=\"application/json\" id=\"{}-data\">{{\"traces\":{},\"layout\":{},\"frames\":{}}}</script>\n", id,
      escaped_for_script(figure.traces), escaped_for_script(figure.layout), escaped_for_script(figure.frames));
}

std::string HtmlPage::text(const std::string& library) const {
  const std::string title = html_escaped(title_);
  std::string page = "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n";
  page += fmt::format("{}\n", mark);
  page += "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n";
  page += "<link rel=\"icon\" href=\"data:,\">\n";
  page += fmt::format("<title>{0}</title>\n<style>{1}</style></head>\n<body>\n<h1>{0}</h1>\n", title, kStyle);
  page += body_ + figures_;
  page += "<script>" + library + "</script>\n<script>" + kScript + "</script>\n</body></html>\n";
  return page;
}

}  // namespace tandem
