#include "fault_list.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace tandem::faults {
namespace {

using Lines = std::vector<Line>;
using Inject = std::function<double(Lines&, const Site&)>;
enum class On { motion, sensor, all };

constexpr double kWrongStamps = 1e9;  // s; larger times are injected faults
constexpr double kBurst = 3;          // s; duration of faults that last

bool is_on(On on, const Line& line, const Site& at) {
  return on == On::all || line.name == (on == On::motion ? at.motion : at.sensor);
}

/// Inserts a changed copy before each of the first `n` lines from the site on. The copied line may then be rejected for
/// its stamp, so the fault lasts until the next line of the stream.
template <class F>
Inject extra(On on, int n, F change) {
  return [=](Lines& lines, const Site& at) {
    const Lines good = lines;
    double until = at.from;
    int left = n;
    for (std::size_t i = 0; i < lines.size() && left > 0; ++i) {
      if (!is_on(on, lines[i], at) || lines[i].t < at.from) continue;
      Line copy = lines[i];
      until = copy.t;
      change(copy);
      lines.insert(lines.begin() + std::ptrdiff_t(i), copy);
      ++i;
      --left;
    }
    const auto next =
        std::find_if(good.begin(), good.end(), [&](const Line& l) { return is_on(on, l, at) && l.t > until; });
    return next == good.end() ? until : next->t;
  };
}

Inject value(On on, int n, const std::string& text) {
  return extra(on, n, [text](Line& line) { line.cells[0] = text; });
}
Inject raw(int n, const std::string& text) {
  return extra(On::all, n, [text](Line& line) { line.raw = text; });
}
Inject stamped(On on, int n, double ahead) {
  return extra(on, n, [ahead](Line& line) { line.t += ahead; });
}
Inject stepped(On on, double by, double seconds = 1e9) {
  return [=](Lines& lines, const Site& at) {
    const double until = at.from + seconds;
    for (Line& line : lines)
      if (is_on(on, line, at) && line.t >= at.from && line.t < until) line.t += by;
    return std::isfinite(until) && seconds < 1e8 ? until : at.from;
  };
}
Inject in_unit(On on, double unit) {
  return [=](Lines& lines, const Site& at) {
    for (Line& line : lines)
      if (is_on(on, line, at)) line.t /= unit;
    return at.from;
  };
}
Inject lost(On on, double seconds) {
  return [=](Lines& lines, const Site& at) {
    std::erase_if(lines, [&](const Line& line) {
      return is_on(on, line, at) && line.t >= at.from && line.t < at.from + seconds;
    });
    return at.from + seconds;
  };
}

/// Inserts two lines with the same wrong stamp, one at the site and one 2 s later.
double same_stamp_twice(Lines& lines, const Site& at) {
  double until = at.from;
  for (const double later : {0.0, 2.0}) {
    const auto line = std::find_if(lines.begin(), lines.end(), [&](const Line& l) {
      return l.name == at.sensor && l.t >= at.from + later && l.t < kWrongStamps;
    });
    if (line == lines.end()) continue;
    Line copy = *line;
    until = copy.t;
    copy.t = 4294967295.0;
    lines.insert(line, copy);
  }
  return until;
}

double first_lines_in_the_future(Lines& lines, const Site&) {
  for (std::size_t i = 0; i < std::min<std::size_t>(20, lines.size()); ++i) lines[i].t += 1.79e9;
  return lines[20].t;
}

double late_lines(Lines& lines, const Site& at) {
  const auto arrives = [&](const Line& l) {
    return l.name == at.sensor && l.t >= at.from && l.t < at.from + kBurst ? l.t + 1.0 : l.t;
  };
  std::stable_sort(lines.begin(), lines.end(), [&](const Line& a, const Line& b) { return arrives(a) < arrives(b); });
  return at.from + kBurst;
}

double swapped_lines(Lines& lines, const Site& at) {
  for (std::size_t i = 0; i + 1 < lines.size(); i += 2)
    if (lines[i].t >= at.from && lines[i].t < at.from + kBurst) std::swap(lines[i], lines[i + 1]);
  return at.from + kBurst;
}

double doubled_lines(Lines& lines, const Site& at) {
  Lines twice;
  for (const Line& line : lines) {
    twice.push_back(line);
    if (line.t >= at.from && line.t < at.from + kBurst) twice.push_back(line);
  }
  lines = std::move(twice);
  return at.from + kBurst;
}

double joined_lines(Lines& lines, const Site& at) {
  for (std::size_t i = 0; i + 1 < lines.size(); ++i)
    if (lines[i].t >= at.from) {
      std::string first = lines[i].text(), second = lines[i + 1].text();
      lines[i].raw = first.substr(0, first.size() / 2) + second.substr(0, second.size() - 1);
      lines.erase(lines.begin() + std::ptrdiff_t(i) + 1);
      return lines[i].t;
    }
  return at.from;
}

double displaced_origin(Lines& lines, const Site& at) {
  for (Line& line : lines)
    if (line.name == at.motion && line.t >= at.from) line.cells[0] = fmt::format("{}", std::stod(line.cells[0]) + 5000);
  return at.from;
}

template <class F>
double frozen(Lines& lines, const Site& at, F freeze) {
  const Line* first = nullptr;
  for (Line& line : lines) {
    if (line.name != at.sensor || line.t < at.from || line.t >= at.from + kBurst) continue;
    if (!first) first = &line;
    freeze(line, *first);
  }
  return at.from + kBurst;
}
double frozen_clock(Lines& lines, const Site& at) {
  return frozen(lines, at, [](Line& line, const Line& first) { line.t = first.t; });
}
double frozen_reading(Lines& lines, const Site& at) {
  return frozen(lines, at, [](Line& line, const Line& first) { line.cells = first.cells; });
}

void all_cells(Line& line, const std::string& text) {
  for (std::string& cell : line.cells) cell = text;
}

std::vector<Fault> make_faults() {
  const std::string unread = "malformed", absurd = "implausible value", jumped = "time jumps away";
  const std::string arrival = "timed by arrival", missing = "missing value";
  std::vector<Fault> faults = {
      {"a value of 1e308", value(On::sensor, 1, "1e308"), absurd},
      {"a value of -1e308", value(On::sensor, 1, "-1e308"), ""},
      {"a value of 1e150", value(On::sensor, 1, "1e150"), absurd},
      {"a value of 1e10", value(On::sensor, 1, "1e10"), absurd},
      {"a value of 1e5", value(On::sensor, 1, "1e5"), ""},
      {"a value of 1e3", value(On::sensor, 1, "1e3"), ""},
      {"a value of -200", value(On::sensor, 1, "-200"), ""},
      {"five absurd values in a row", value(On::sensor, 5, "1e6"), ""},
      {"all values 1e308", extra(On::sensor, 1, [](Line& l) { all_cells(l, "1e308"); }), ""},
      {"every stream reads 1e308", extra(On::all, 10, [](Line& l) { l.cells[0] = "1e308"; }), absurd},
      {"text instead of a value", value(On::sensor, 1, "abc"), unread},
      {"nan", value(On::sensor, 1, "nan"), missing},
      {"infinity", value(On::sensor, 1, "inf"), unread},
      {"an empty cell", value(On::sensor, 1, ""), missing},
      {"too few columns", extra(On::sensor, 1, [](Line& l) { l.cells.pop_back(); }), unread},
      {"too many columns", extra(On::sensor, 1, [](Line& l) { l.cells.push_back("1"); }), unread},
      {"garbage", raw(200, "$!%,;;\x01\x02,9"), "malformed"},
      {"an unknown sensor", raw(1, "sonar,1,2,3"), "unknown sensor"},
      {"control bytes", raw(3, "\x1b]0;x\x07\x1b[2J"), "unknown sensor"},
      {"a very long line", raw(1, std::string(100'000, '7')), "unknown sensor"},
      {"two lines in one", joined_lines, ""},
      {"motion of 1e308", value(On::motion, 1, "1e308"), absurd},
      {"motion of 1e6", value(On::motion, 1, "1e6"), ""},
      {"motion of nan", value(On::motion, 1, "nan"), missing},
      {"a zero quaternion in the odometry", extra(On::motion, 1, [](Line& l) { all_cells(l, "0"); }), "", true},
      {"a jump of the odometry", displaced_origin, "jumped to a new origin", true},
      {"a stamp of motion 300 s ahead", stamped(On::motion, 1, 300), jumped},
      {"a stamp of motion 5 s ahead", stamped(On::motion, 1, 5), jumped},
      {"a stamp of motion 1000 s behind", stamped(On::motion, 1, -1000), jumped},
      {"a stamp 300 s ahead", stamped(On::sensor, 1, 300), jumped},
      {"a stamp 1000 s behind", stamped(On::sensor, 1, -1000), jumped},
      {"a stamp of 1e300", stamped(On::sensor, 1, 1e300), jumped},
      {"the same wrong stamp twice", same_stamp_twice, jumped},
      {"three wrong stamps in a row", stamped(On::sensor, 3, 1e6), ""},
      {"text instead of a stamp", raw(1, "odometry,abc,0,0,0,0,0,0,1"), ""},
      {"the first lines in the future", first_lines_in_the_future, "the time base"},
      {"all clocks jump to 2026", stepped(On::all, 1.79e9), arrival},
      {"all clocks back by an hour", stepped(On::all, -3600), arrival},
      {"all clocks back by an hour, then forward again", stepped(On::all, -3600, 3), ""},
      {"a sensor's clock back by 500 s", stepped(On::sensor, -500), arrival},
      {"a sensor's clock forward by 500 s", stepped(On::sensor, 500), arrival},
      {"a sensor's clock forward by 500 s, then back again", stepped(On::sensor, 500, 3), ""},
      {"the motion's clock back by 500 s", stepped(On::motion, -500), arrival},
      {"stamps in milliseconds", in_unit(On::all, 1e-3), "milliseconds"},
      {"stamps in microseconds", in_unit(On::all, 1e-6), "microseconds"},
      {"stamps in nanoseconds", in_unit(On::all, 1e-9), "nanoseconds"},
      {"all streams silent", lost(On::all, kBurst), ""},
      {"a silent sensor", lost(On::sensor, kBurst), ""},
      {"silent motion", lost(On::motion, 1.0), ""},
      {"repeated lines", doubled_lines, ""},
      {"lines out of order", swapped_lines, ""},
      {"late lines", late_lines, ""},
      {"a frozen clock", frozen_clock, ""},
      {"a frozen reading", frozen_reading, ""},
  };
  return faults;
}

}  // namespace

const std::vector<Fault>& all_faults() {
  static const std::vector<Fault> faults = make_faults();
  return faults;
}

}  // namespace tandem::faults
