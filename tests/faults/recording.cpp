#include "recording.hpp"

#include <algorithm>
#include <fstream>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/navigation/navigated_scenario.hpp>
#include <tandem/studies/online/online_feed.hpp>
#include <tandem/studies/online/track.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem::faults {

std::string Line::text() const {
  if (!raw.empty()) return raw + "\n";
  return fmt::format("{},{}{}{}\n", name, t, cells.empty() ? "" : ",", fmt::join(cells, ","));
}

Recording::Recording(const std::filesystem::path& folder, double until)
    : settings(read_settings(folder, RowsIn::files)) {
  const bool by_odometry = moves_by_odometry(settings);
  const FeedStreams streams(settings);
  for (const FeedStream& stream : streams.all()) {
    const bool moves = stream.kind == (by_odometry ? FeedStream::Kind::odometry : FeedStream::Kind::imu);
    if (moves)
      motion = stream.name;
    else
      sensors.push_back(stream.name);
    std::ifstream file(stream.file);
    for (std::string row; std::getline(file, row);) {
      std::replace(row.begin(), row.end(), ',', ' ');
      const auto cells = words(row);
      const auto t = cells.empty() ? std::nullopt : parse_number(cells.front());
      if (t) lines.push_back({*t, stream.name, {cells.begin() + 1, cells.end()}});
    }
  }
  if (lines.empty()) throw Error(folder.string() + " has no lines");
  std::stable_sort(lines.begin(), lines.end(), [](const Line& a, const Line& b) { return a.t < b.t; });
  const double last = lines.front().t + until;
  std::erase_if(lines, [&](const Line& line) { return line.t > last; });
  read_truth(settings);
}

std::string Recording::text() const {
  std::string text;
  for (const Line& line : lines) text += line.text();
  return text;
}

}  // namespace tandem::faults
