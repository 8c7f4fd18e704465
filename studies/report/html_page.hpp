#pragma once

#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace tandem {

/// A picture drawn by Plotly when the page is opened: its traces and layout, as plotly.js takes them (JSON).
struct HtmlFigure {
  std::string title, caption;
  std::string traces, layout;  ///< JSON
  std::string frames = "[]";   ///< JSON: of an animation, which the layout's buttons and sliders play
  int height = 420;            ///< pixels

  HtmlFigure(std::string title, std::string caption, const nlohmann::ordered_json& traces,
             const nlohmann::ordered_json& layout, int height);
  void set_frames(const nlohmann::ordered_json& all);
};

/// One self-contained page of HTML: everything is in it, nothing is fetched. Texts are escaped.
class HtmlPage {
 public:
  explicit HtmlPage(std::string title) : title_(std::move(title)) {}

  void heading(const std::string& text);
  void paragraph(const std::string& text);
  void code(const std::string& text);
  /// The first column is of text, the others are right-aligned.
  void table(const std::vector<std::string>& head, const std::vector<std::vector<std::string>>& rows);
  /// One that may be long, which unfolds below its summary; a short one is open.
  void folded_table(const std::string& summary, const std::vector<std::string>& head,
                    const std::vector<std::vector<std::string>>& rows);
  void figure(const HtmlFigure& figure);

  /// `library`: the source of plotly.js.
  std::string text(const std::string& library) const;

 private:
  std::string title_, body_, figures_;
  int count_ = 0;
};

/// With `<`, `>`, `&` and quotes as entities.
std::string html_escaped(const std::string& text);

}  // namespace tandem
