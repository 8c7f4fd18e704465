#include <cmath>

#include <fmt/format.h>

#include <tandem/studies/online/track_snapshot.hpp>
#include <tandem/studies/support/fnv1a.hpp>

#include "fuzz/input.hpp"

namespace {

using namespace tandem;

/// Returns the bytes of a snapshot with a value of each kind.
std::string valid_snapshot() {
  TrackSnapshot s;
  s.scenario = "small";
  s.streams = {"ENU-FLU", "usbl (t,x,y,z)"};
  s.start = Alignment{.t = 3.25};
  s.start->sigmas.bias = Vector<6>::Ones();
  s.lines = {{1.5, 0, true, Stamped<SE3>{1.5, SE3()}},
             {2.5, 1, false, ImuSample{2.5, {1, 2, 9.81}, {0.1, 0.2, 0.3}}},
             {3.5, 2, false, EgoMeasurement{3.5, {3, 2, 1}, SO3()}},
             {4.5, 3, false, Measurement{4.5, {7, 8, 9}, SO3(), 10, 0.5, -0.25, false, 2}}};
  s.feed.rows = {3, 0, 7};
  s.feed.clocks = {99.5, -HUGE_VAL, {{1e-9, -3600, 12.25, 0.1, 0.01, 1}, {}}};
  s.feed.rejected_lines = {{{"usbl", "repeats a time"}, 3}};
  s.health.sensors = {{"usbl", 5, 2, 1, 12.0, 11.5, 0.75}};
  s.hypotheses = {7.5, {1, -0.5}};
  s.faulty_intervals = {5, 2, true, FaultyIntervalDetector::Interval{10, 12, true}, {}};
  s.partial = {"0123abc", {1, 2, 3}, 17};
  return bytes_of(s);
}

}  // namespace

// The snapshot of a track. The header and its checksum are always right. The first byte selects the meaning of the
// others: changes of single bytes of a valid document, or the whole document. A change has three bytes: two for the
// place and one for the new value.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::string valid = valid_snapshot();
  static const std::string kind_line = valid.substr(0, valid.find('\n') + 1);
  static const std::string document = valid.substr(valid.find('\n', kind_line.size()) + 1);
  fuzz::Input input(data, size);
  std::string bytes = document;
  if (input.below(2) == 0) {
    while (!input.empty()) {
      const std::size_t place = std::size_t(input.byte()) << 8 | input.byte();
      bytes[place % bytes.size()] = static_cast<char>(input.byte());
    }
  } else {
    bytes = input.text();
  }
  fuzz::accepts([&] {
    const TrackSnapshot snapshot = parse_snapshot(fmt::format("{}{:016x}\n{}", kind_line, fnv1a(bytes), bytes), "file");
    const std::string written = bytes_of(snapshot);
    fuzz::expect(bytes_of(parse_snapshot(written, "again")) == written, "writing and reading keep a snapshot");
    StreamClocks clocks(std::vector<StreamClocks::Stream>(snapshot.feed.clocks.streams.size()));
    clocks.restore(snapshot.feed.clocks);
  });
  return 0;
}
