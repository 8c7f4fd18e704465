#pragma once

#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace tandem {

/// A figure that plotly.js draws when the page is opened.
struct HtmlFigure {
  std::string title, caption;
  std::string traces, layout;  ///< JSON arguments of Plotly.newPlot
  std::string frames = "[]";   ///< JSON frames of an animation that the layout's buttons and sliders control
  int height = 420;            ///< pixels
  double aspect = 0;           ///< height over width of contents with equal scales: a narrow page shrinks the height

  HtmlFigure(std::string title, std::string caption, const nlohmann::ordered_json& traces,
             const nlohmann::ordered_json& layout, int height, double aspect = 0);
  void set_frames(const nlohmann::ordered_json& all);
};

/// Builder of a self-contained HTML page without external resources. All texts are escaped.
class HtmlPage {
 public:
  /// A line of each page, by which Tandem recognises its own pages.
  static constexpr const char* mark = "<meta name=\"generator\" content=\"tandem\">";

  explicit HtmlPage(std::string title) : title_(std::move(title)) {}

  void heading(const std::string& text);
  void paragraph(const std::string& text);
  /// Adds the conclusion of the page, marked as good or bad.
  void conclusion(bool good, const std::string& text);
  void list(const std::vector<std::string>& items);
  void code(const std::string& text);
  /// Adds a table. The first column is left-aligned, the others are right-aligned.
  void table(const std::vector<std::string>& head, const std::vector<std::vector<std::string>>& rows);
  /// Adds a table that can be folded below its summary. Short tables are open.
  void folded_table(const std::string& summary, const std::vector<std::string>& head,
                    const std::vector<std::vector<std::string>>& rows);
  void figure(const HtmlFigure& figure);

  /// Returns the page. `library`: source of plotly.js.
  std::string text(const std::string& library) const;

 private:
  std::string title_, body_, figures_;
  int count_ = 0;
};

}  // namespace tandem
