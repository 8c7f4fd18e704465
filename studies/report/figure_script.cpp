#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <map>

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include <tandem/studies/report/figure_script.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kFigureWidth = 560, kLeftMargin = 0.17, kRightMargin = 0.94;  // pixels; fractions of the width
constexpr double kBelowPanels = 68, kAbovePanels = 34, kKeyRow = 21;           // pixels

/// Returns a text in quotes for gnuplot, without the markup of pages.
std::string in_quotes(std::string text) {
  for (const auto& [entity, character] :
       {std::pair{"&lt;", "<"}, {"&gt;", ">"}, {"&quot;", "\""}, {"&amp;", "&"}, {"'", "''"}}) {
    const std::string_view from = entity, to = character;
    for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size())
      text.replace(at, from.size(), to);
  }
  return "'" + printable(text) + "'";
}

/// Returns a colour of a page ("rgb(r,g,b)", "rgba(r,g,b,a)", "#rrggbb") as gnuplot writes it.
std::string gnuplot_colour(const std::string& css, double opacity = 1) {
  int r = 0, g = 0, b = 0;
  double a = 1;
  if (css.starts_with("#")) {
    const auto rgb = static_cast<unsigned>(std::strtoul(css.c_str() + 1, nullptr, 16));
    r = int(rgb >> 16), g = int(rgb >> 8 & 255), b = int(rgb & 255);
  } else if (std::sscanf(css.c_str(), "rgba(%d,%d,%d,%lf)", &r, &g, &b, &a) < 4) {
    std::sscanf(css.c_str(), "rgb(%d,%d,%d)", &r, &g, &b);
  }
  return fmt::format("'#{:02x}{:02x}{:02x}{:02x}'", int(std::lround(255 * (1 - a * opacity))), r, g, b);
}

double number_of(const Json& value) { return value.is_number() ? value.get<double>() : std::nan(""); }

/// The least and the largest of several numbers.
struct AxisRange {
  double low = HUGE_VAL, high = -HUGE_VAL;

  void add(double v) {
    if (std::isfinite(v)) low = std::min(low, v), high = std::max(high, v);
  }
  void add(const Json& values) {
    for (const Json& v : values) add(number_of(v));
  }
  bool empty() const { return !(low <= high); }
  double size() const { return high - low; }
  std::string text(const std::string& axis, bool reversed = false) const {
    return fmt::format("set {}range [{:.10g}:{:.10g}]\n", axis, reversed ? high : low, reversed ? low : high);
  }
};

class FigureScript {
 public:
  FigureScript(const HtmlFigure& figure, PlotFormat format)
      : figure_(figure), traces_(Json::parse(figure.traces)), layout_(Json::parse(figure.layout)) {
    const Json& x = layout_.value("xaxis", Json::object());
    dates_ = x.value("type", "") == "date";
    text_ = fmt::format("set encoding utf8\nformat = '{}'\noutput = ''\nload {}\n", extension(format),
                        in_quotes((plot_scripts() / "terminal.gp").string()));
    for (std::size_t i = 0; i < traces_.size(); ++i) add_data(i);
    add_legend();
  }

  std::string text() {
    if (layout_.contains("scene")) {
      draw_in_space();
    } else if (layout_["yaxis"].contains("scaleanchor")) {
      draw_map();
    } else {
      draw_panels();
    }
    return text_;
  }

 private:
  void line(const std::string& text) { text_ += text + "\n"; }

  void add_data(std::size_t i) {
    const Json& trace = traces_[i];
    line(fmt::format("$d{} << END", i));
    for (std::size_t k = 0; k < trace["x"].size(); ++k) {
      const double x = x_of(trace["x"][k]), y = number_of(trace["y"][k]);
      const double z = trace.contains("z") ? number_of(trace["z"][k]) : 0;
      line(std::isfinite(x + y + z) ? fmt::format("{:.10g} {:.8g} {:.8g}", x, y, z) : "");
    }
    line("END");
  }
  /// Returns a value of the x axis: seconds on time axes, which have ms in pages.
  double x_of(const Json& x) const { return dates_ ? 1e-3 * number_of(x) : number_of(x); }

  /// Collects the entries of the legend, and reserves its rows.
  void add_legend() {
    std::size_t longest = 1;
    for (std::size_t i = 0; i < traces_.size(); ++i) {
      const Json& trace = traces_[i];
      const std::string name = trace.value("name", "");
      if (name.empty() || !trace.value("showlegend", true)) continue;
      longest = std::max(longest, name.size());
      legend_.push_back(fmt::format("keyentry {} title {}", style_of(trace, true), in_quotes(name)));
    }
    longest_ = double(longest);
    const std::size_t most = 0.96 * kFigureWidth > 2 * (60 + 8.7 * longest_) ? 2 : 1;
    columns_ = std::clamp<std::size_t>(legend_.size(), 1, most);
    above_ = kAbovePanels + kKeyRow * std::ceil(double(legend_.size()) / double(columns_)) + 6;
  }

  /// Returns the style of a trace for `plot`.
  static std::string style_of(const Json& trace, bool in_legend = false) {
    if (trace.contains("fill"))
      return fmt::format("with filledcurves closed lc rgb {}", gnuplot_colour(trace.value("fillcolor", "#cccccc")));
    if (trace.value("mode", "") == "markers") {
      const Json& marker = trace["marker"];
      const std::string symbol = marker.value("symbol", "circle");
      const std::string colour = gnuplot_colour(marker.value("color", "#000000"), marker.value("opacity", 1.0));
      if (symbol == "line-ns-open" && !in_legend)
        return fmt::format("using 1:($2-0.32):(0):(0.64) with vectors nohead lw 0.7 lc rgb {}", colour);
      static const std::map<std::string, int> kTypes = {
          {"circle-open", 6}, {"square", 5}, {"x", 2}, {"line-ns-open", 5}};
      const auto type = kTypes.find(symbol);
      return fmt::format("with points pt {} ps {:.3g} lc rgb {}", type == kTypes.end() ? 7 : type->second,
                         in_legend ? 0.6 : marker.value("size", 4.0) / 12, colour);
    }
    const Json& of = trace["line"];
    const std::string dash = of.value("dash", "solid");
    return fmt::format("with {} lw {:.3g} dt {} lc rgb {}", of.value("shape", "") == "hv" ? "steps" : "lines",
                       of.value("width", 1.5) / (trace.contains("z") ? 3 : 1),
                       dash == "dot"    ? 3
                       : dash == "dash" ? 2
                                        : 1,
                       gnuplot_colour(of.value("color", "#000000")));
  }

  void open(double height) {
    height_ = height;
    line(fmt::format("eval opened({}, {:.0f}, column_inches)\nset termoption noenhanced", kFigureWidth, height));
    line(fmt::format("set label 1 {} at screen 0.02,screen {:.5f}", in_quotes(figure_.title), 1 - 20 / height));
    line(
        fmt::format("set key at screen 0.015,screen {:.5f} left top horizontal maxcols {} reverse Left samplen 1.2 "
                    "width -1",
                    1 - 30 / height, columns_, 3.8 - 0.36 * longest_));  // gnuplot takes letters for too wide
    line("set border 3 lc rgb '#555555'\nset tics nomirror tc rgb '#333333'\nset grid lc rgb '#e8e8e8' lt 1");
  }

  /// Returns the traces that a y axis has ("y", "y2", …).
  std::vector<std::size_t> traces_of(const std::string& axis) const {
    std::vector<std::size_t> of;
    for (std::size_t i = 0; i < traces_.size(); ++i)
      if (traces_[i].value("yaxis", "y") == axis) of.push_back(i);
    return of;
  }

  std::string plot_of(const std::vector<std::size_t>& traces, bool legend) const {
    std::string all;
    for (const std::size_t i : traces) {
      if (std::none_of(traces_[i]["y"].begin(), traces_[i]["y"].end(), [](const Json& y) { return y.is_number(); }))
        continue;
      all += fmt::format("{}$d{} {} notitle", all.empty() ? "" : ", ", i, style_of(traces_[i]));
    }
    if (all.empty()) all = "NaN notitle";
    if (legend)
      for (const std::string& entry : legend_) all += ", " + entry;
    return all;
  }

  void set_x_axis() {
    const Json& x = layout_["xaxis"];
    AxisRange range;
    if (x.contains("range"))
      for (const Json& end : x["range"]) range.add(x_of(end));
    else
      for (const Json& trace : traces_) range.add(trace["x"]);
    if (range.empty()) range = {0, 1};
    if (!(range.size() > 0)) range.high += 1;
    text_ += range.text("x");
    if (x.value("type", "") == "log") line("set logscale x");
    x_title_ = title_of(x);
    if (!dates_) return;
    double step = 1;
    for (const double longer : {2, 5, 10, 20, 30, 60, 120, 300, 600, 1200, 1800, 3600, 7200, 14400, 28800, 86400})
      if (range.size() / step > 5) step = longer;
    line(fmt::format("set xtics {}", step));
    x_format_ = x.contains("tickformat") ? "'%tH:%tM:%tS' timedate" : "'%H:%M:%S' timedate";
    if (!x.contains("tickformat")) x_title_ += fmt::format(", {:%Y-%m-%d}", fmt::gmtime(std::time_t(range.low)));
  }
  static std::string title_of(const Json& axis) {
    return axis.contains("title") ? axis["title"].value("text", "") : "";
  }

  void set_y_axis(const Json& axis, const std::vector<std::size_t>& traces, double height) {
    const bool log = axis.value("type", "") == "log";
    AxisRange range;
    if (axis.contains("range")) {
      range.add(axis["range"]);
    } else {
      for (const std::size_t i : traces)
        for (const Json& y : traces_[i]["y"])
          if (!log || number_of(y) > 0) range.add(number_of(y));
      if (axis.value("rangemode", "") == "tozero") range.add(0.0);
      if (range.empty()) range = {log ? 1.0 : 0.0, 10};
      if (log) {
        range = {range.low / 1.3, range.high * 1.3};
      } else {
        const double margin = range.size() > 0 ? 0.04 * range.size() : 0.5;
        range = {range.low - (axis.value("rangemode", "") == "tozero" && range.low == 0 ? 0 : margin),
                 range.high + margin};
      }
    }
    const bool reversed = axis.value("autorange", "") == "reversed" ||
                          (axis.contains("range") && number_of(axis["range"][0]) > number_of(axis["range"][1]));
    text_ += range.text("y", reversed);
    line(log ? "set logscale y" : "unset logscale y");
    line("set format y '%g'");
    if (axis.contains("tickvals")) {
      std::vector<std::string> tics;
      for (std::size_t i = 0; i < axis["tickvals"].size(); ++i)
        tics.push_back((axis.contains("ticktext") ? in_quotes(axis["ticktext"][i].get<std::string>()) + " " : "") +
                       fmt::format("{}", number_of(axis["tickvals"][i])));
      line(fmt::format("set ytics ({})", fmt::join(tics, ", ")));
    } else if (log) {
      set_log_tics(range);
    } else {
      line("set ytics autofreq");
    }
    std::string title = in_quotes(title_of(axis));
    const std::size_t space = title.find(' ');
    const bool two_lines = height < 100 && space != std::string::npos;
    if (two_lines) title = title.substr(0, space) + "'.\"\\n\".'" + title.substr(space + 1);
    line(fmt::format("set ylabel {} offset {},0", title, two_lines ? -0.8 : 0.5));
  }
  /// Sets tics at the powers of ten, and between them on a short axis.
  void set_log_tics(const AxisRange& range) {
    std::vector<std::string> tics;
    const bool few = range.high / range.low < 300;
    for (double decade = std::pow(10, std::floor(std::log10(range.low))); decade <= range.high; decade *= 10)
      for (const double m : {1, 2, 5})
        if ((m == 1 || few) && m * decade >= range.low && m * decade <= range.high)
          tics.push_back(fmt::format("{:g}", m * decade));
    line(fmt::format("set ytics ({})", fmt::join(tics, ", ")));
  }

  void draw_panels() {
    open(std::max(60.0, 0.8 * (figure_.height - 70)) + above_ + kBelowPanels);
    set_x_axis();
    line("set multiplot");
    line(fmt::format("set lmargin at screen {}\nset rmargin at screen {}", kLeftMargin, kRightMargin));
    std::vector<std::pair<std::string, Json>> panels;
    for (const auto& [key, axis] : layout_.items())
      if (key.starts_with("yaxis")) panels.emplace_back("y" + key.substr(5), axis);
    const double low = kBelowPanels / height_, high = 1 - above_ / height_;
    for (std::size_t p = 0; p < panels.size(); ++p) {
      const auto& [name, axis] = panels[p];
      const std::vector<std::size_t> traces = traces_of(name);
      const Json domain = axis.value("domain", Json{0.0, 1.0});
      const double bottom = low + (high - low) * number_of(domain[0]);
      const double top = low + (high - low) * number_of(domain[1]) - (p > 0 ? 8 / height_ : 0);
      line(fmt::format("set bmargin at screen {:.5f}\nset tmargin at screen {:.5f}", bottom, top));
      set_y_axis(axis, traces, (top - bottom) * height_);
      const bool last = p + 1 == panels.size();
      line(last && dates_ ? "set format x " + x_format_ : last ? "set format x '%g'" : "set format x ''");
      line(last ? "set xlabel " + in_quotes(x_title_) : "unset xlabel");
      std::string levels;
      for (const Json& shape : layout_.value("shapes", Json::array()))
        if (shape.value("yref", "") == name)
          levels += fmt::format("{:g} with lines lw 0.7 dt 3 lc rgb '#7b8794' notitle, ", number_of(shape["y0"]));
      line("plot " + levels + plot_of(traces, p == 0));
      line("unset label 1\nunset key");
    }
    line("unset multiplot");
  }

  void draw_map() {
    AxisRange x, y;
    for (const Json& trace : traces_) x.add(trace["x"]), y.add(trace["y"]);
    if (x.empty()) x = {0, 1};
    if (y.empty()) y = {0, 1};
    const double margin = 0.04 * std::max({x.size(), y.size(), 1.0});
    const double tall = std::max(y.size() + 2 * margin, 0.3 * (x.size() + 2 * margin));
    const double wide = std::max(x.size() + 2 * margin, 0.9 * tall);
    const auto widened = [](const AxisRange& of, double size) {
      return AxisRange{(of.low + of.high - size) / 2, (of.low + of.high + size) / 2};
    };
    open((kRightMargin - kLeftMargin) * kFigureWidth * tall / wide + above_ + kBelowPanels);
    line(
        fmt::format("set lmargin at screen {}\nset rmargin at screen {}\nset bmargin at screen {:.5f}\n"
                    "set tmargin at screen {:.5f}\nset size ratio -1",
                    kLeftMargin, kRightMargin, kBelowPanels / height_, 1 - above_ / height_));
    text_ += widened(x, wide).text("x") + widened(y, tall).text("y");
    line(fmt::format("set xlabel {}\nset ylabel {}", in_quotes(title_of(layout_["xaxis"])),
                     in_quotes(title_of(layout_["yaxis"]))));
    line("plot " + plot_of(traces_of("y"), true));
  }

  void draw_in_space() {
    const Json& scene = layout_["scene"];
    open(400 + above_);
    for (const char* axis : {"x", "y", "z"}) {
      const Json& of = scene[std::string(axis) + "axis"];
      AxisRange range;
      range.add(of["range"]);
      if (!(range.size() > 0)) range.high += 1;
      text_ += range.text(axis, number_of(of["range"][0]) > number_of(of["range"][1]));
      if (axis[0] != 'z') {
        line(fmt::format("set {}label {} rotate parallel", axis, in_quotes(title_of(of))));
        continue;
      }
      line(fmt::format("set label 2 {} at screen 0.03,screen 0.3 rotate", in_quotes(title_of(of))));
      line(fmt::format("set ztics {:.1g}", std::max(range.size() / 4, 1e-9)));
    }
    const Json& ratio = scene["aspectratio"];
    const double horizontal = std::max(number_of(ratio["x"]), number_of(ratio["y"]));
    line("set border 4095 lc rgb '#cccccc'\nset xyplane relative 0\nset xtics 5\nset xtics autofreq");
    line(fmt::format("set view 62,28,0.95,{:.3g}\nset view equal xy", 1.4 * number_of(ratio["z"]) / horizontal));
    line(
        fmt::format("set lmargin at screen 0.14\nset rmargin at screen 0.92\nset bmargin at screen 0.08\n"
                    "set tmargin at screen {:.5f}",
                    1 - above_ / height_));
    std::string all;
    for (std::size_t i = 0; i < traces_.size(); ++i)
      all += fmt::format("{}$d{} using 1:2:3 {} notitle", i ? ", " : "", i, style_of(traces_[i]));
    for (const std::string& entry : legend_) all += ", " + entry;
    line("splot " + all);
  }

  const HtmlFigure& figure_;
  Json traces_, layout_;
  bool dates_ = false;
  std::vector<std::string> legend_;
  std::size_t columns_ = 1;        // of the legend
  double longest_ = 1;             // characters of the longest name
  double above_ = 0, height_ = 0;  // pixels: above the panels, and of the figure
  std::string text_, x_title_, x_format_;
};

}  // namespace

std::string figure_script(const HtmlFigure& figure, PlotFormat format) { return FigureScript(figure, format).text(); }

}  // namespace tandem
