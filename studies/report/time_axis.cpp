#include <cmath>
#include <ctime>

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <tandem/studies/report/time_axis.hpp>
#include <tandem/studies/support/utc_stamps.hpp>

namespace tandem::plot {
namespace {

constexpr double kDay = 86400, kHour = 3600;  // s

}  // namespace

TimeAxis::TimeAxis(double start, double span)
    : start_(start), span_(span), utc_(start > kSince1970), hours_(!utc_ && !(span < kDay)) {}

Json TimeAxis::values(const std::vector<double>& t) const {
  Json array = Json::array();
  for (const double value : t)
    if (!std::isfinite(value))
      array.push_back(nullptr);
    else if (hours_)
      array.push_back(number(value / kHour));
    else
      array.push_back(
          std::llround(1e3 * (utc_ ? start_ + value : value)));  // ms since 1970; the page converts them to dates
  return array;
}

Json TimeAxis::axis() const {
  Json axis = layout(utc_ ? "UTC" : hours_ ? "time since start [h]" : "time since start [h:min:s]", "")["xaxis"];
  if (hours_) return axis;
  axis["type"] = "date";
  axis["range"] = values({-0.01 * span_, 1.01 * span_});
  axis["hoverformat"] = "%H:%M:%S.%L";
  if (!utc_) axis["tickformat"] = "%H:%M:%S";
  return axis;
}

std::string TimeAxis::text(double t) const {
  if (utc_) return fmt::format("{:%H:%M:%S}", fmt::gmtime(std::time_t(std::floor(start_ + t))));
  const long long seconds = std::llround(t);
  return fmt::format("{:02}:{:02}:{:02}", seconds / 3600, seconds / 60 % 60, seconds % 60);
}

std::string TimeAxis::start_text() const {
  return utc_ ? fmt::format("{:%Y-%m-%d %H:%M:%S} UTC", fmt::gmtime(std::time_t(std::floor(start_)))) : "";
}

}  // namespace tandem::plot
