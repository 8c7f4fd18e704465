#pragma once

#include <string>
#include <vector>

#include <tandem/studies/report/html_page.hpp>
#include <tandem/studies/report/time_axis.hpp>

namespace tandem::plot {

/// Builder of a figure of panels above each other with a common time axis. Times are in seconds since the start.
class TimePanels {
 public:
  /// `shares`: relative heights of the panels, from the top. `height`: of all panels [pixels].
  TimePanels(const TimeAxis& time, std::vector<double> shares, int height);

  /// Begins the next panel; returns its y axis.
  Json& panel(const std::string& title);
  /// Adds a line to the panel. The first of several lines with the same name is in the legend; an empty name is not.
  Json& line(const std::string& name, const std::vector<double>& t, const std::vector<double>& y,
             const std::string& colour, double width = 1.5);
  /// Adds points to the panel.
  Json& points(const std::string& name, const std::vector<double>& t, const std::vector<double>& y,
               const std::string& colour, double size, const std::string& symbol = "circle");
  /// Adds the band from −half to half. It ends where `half` has no value.
  void band(const std::vector<double>& t, const std::vector<double>& half, const std::string& colour);
  /// Adds strips: a tick for each time, in a row of the panel.
  Json& ticks(const std::string& name, const std::vector<double>& t, double row, const std::string& colour);
  /// Adds a dotted line across the panel.
  void level(double y);

  HtmlFigure figure(const std::string& title, const std::string& caption) const;

 private:
  TimeAxis time_;
  std::vector<double> shares_;
  int height_;
  std::size_t panels_ = 0;
  Json traces_ = Json::array(), layout_;
  std::vector<std::string> names_;

  std::string axis_name() const;
  Json& add(const std::string& name, const std::vector<double>& t, Json trace);
};

}  // namespace tandem::plot
