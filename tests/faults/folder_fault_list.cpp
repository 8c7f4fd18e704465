#include "folder_fault_list.hpp"

#include <algorithm>
#include <fstream>
#include <optional>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/stat.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem::faults {
namespace {

namespace fs = std::filesystem;
using FileLines = std::vector<std::string>;
using Which = FileLines& (Folder::*)();
using Change = std::function<void(Folder&)>;

constexpr Which kMotion = &Folder::motion_lines, kSensor = &Folder::sensor_lines;

bool is_tum(const std::string& file) { return file.ends_with(".tum"); }

/// Returns the time at the start of a line, or nothing if the line is not a row.
std::optional<double> time_of(const std::string& line) {
  return parse_number(std::string_view(line).substr(0, line.find_first_of(", \t")));
}
FileLines cells_of(const std::string& line) {
  FileLines cells;
  const char separator = line.find(',') == std::string::npos ? ' ' : ',';
  for (const std::string_view cell : split(line, separator)) cells.emplace_back(cell);
  return cells;
}
std::string joined(const FileLines& cells, char separator) {
  return fmt::format("{}", fmt::join(cells, std::string(1, separator)));
}
/// Returns a row in the middle.
std::string& row(FileLines& lines) { return lines[lines.size() / 2]; }

Change lines(Which which, std::function<void(FileLines&)> change) {
  return [which, change = std::move(change)](Folder& folder) { change((folder.*which)()); };
}
Change cell(Which which, std::size_t column, const std::string& text) {
  return lines(which, [=](FileLines& all) {
    std::string& line = row(all);
    const char separator = line.find(',') == std::string::npos ? ' ' : ',';
    FileLines cells = cells_of(line);
    cells.at(column) = text;
    line = joined(cells, separator);
  });
}
Change times(Which which, std::function<double(double)> change, bool one_row = false) {
  return lines(which, [=](FileLines& all) {
    for (std::string& line : all) {
      if (one_row && &line != &row(all)) continue;
      if (const auto t = time_of(line))
        line = fmt::format("{:.9f}", change(*t)) + line.substr(line.find_first_of(", \t"));
    }
  });
}
Change all_times(double unit) {
  return [=](Folder& folder) {
    for (auto& [name, all] : folder.files)
      for (std::string& line : all)
        if (const auto t = time_of(line))
          line = fmt::format("{:.0f}", *t / unit) + line.substr(line.find_first_of(", \t"));
  };
}
Change yaml(std::function<void(std::string&)> change) {
  return [=](Folder& folder) { change(folder.yaml); };
}
/// Replaces the first standard deviation in a list of scenario.yaml.
Change sigma(const std::string& text) {
  return yaml([=](std::string& all) {
    const bool declared = all.find("sigma: [") != std::string::npos;
    const std::size_t from = all.find('[', all.find(declared ? "sigma: [" : "constant_twist:")) + 1;
    all.replace(from, all.find_first_of(",]", from) - from, text);
  });
}

enum class File { motion, sensor };
std::function<void(const fs::path&, const Folder&)> instead(File file, std::function<void(const fs::path&)> make) {
  return [=](const fs::path& folder, const Folder& of) {
    const fs::path path = folder / (file == File::motion ? of.motion : of.sensor);
    fs::remove(path);
    make(path);
  };
}
void a_folder(const fs::path& path) { fs::create_directory(path); }
void a_pipe(const fs::path& path) { mkfifo(path.c_str(), 0600); }
void a_loop(const fs::path& path) { fs::create_symlink(path.filename(), path); }
void a_device(const fs::path& path) { fs::create_symlink("/dev/zero", path); }
void nothing(const fs::path&) {}

void cut_in_a_line(FileLines& all) {
  std::string& line = row(all);
  line.resize(line.find_first_of(", ") + 2);
  all.resize(all.size() / 2 + 1);
}
void half_the_lines(FileLines& all) {
  FileLines kept;
  for (std::size_t i = 0; i < all.size(); ++i)
    if (i % 2 == 0 || !time_of(all[i])) kept.push_back(all[i]);
  all = kept;
}
void repeat_lines(FileLines& all) {
  FileLines twice;
  for (const std::string& line : all) twice.insert(twice.end(), time_of(line) ? 2 : 1, line);
  all = twice;
}
void windows_ends(FileLines& all) {
  for (std::string& line : all) line += "\r";
}
void comments(FileLines& all) {
  FileLines commented;
  for (const std::string& line : all) {
    commented.push_back(line);
    if (time_of(line)) commented.insert(commented.end(), {"", "# \x1b[2Jremark", "   "});
  }
  all = commented;
}
void mark_bytes(FileLines& all) { all.front() = "\xEF\xBB\xBF" + all.front(); }
void swap_rows(FileLines& all) { std::swap(row(all), all[all.size() / 2 + 1]); }
void other_of_one_time(FileLines& all) {
  const std::size_t at = all.size() / 2;
  const std::string first = all[at];
  const char separator = first.find(',') == std::string::npos ? ' ' : ',';
  FileLines cells = cells_of(first);
  cells[1] = fmt::format("{}", parse_number(cells[1]).value_or(0) + 0.5);
  all.insert(all.begin() + std::ptrdiff_t(at) + 1, joined(cells, separator));
}

std::vector<FolderFault> make_folder_faults() {
  using enum ExpectedOutcome;
  const auto minus_first = [](std::string& all) { all.insert(0, "\x80\xff\x1b]0;x\x07: [\n"); };
  std::vector<FolderFault> faults = {
      {"sensor file truncated within a line", lines(kSensor, cut_in_a_line), rejected, "SENSOR:"},
      {"motion file truncated within a line", lines(kMotion, cut_in_a_line), rejected, "MOTION:"},
      {"empty sensor file", lines(kSensor, [](FileLines& l) { l.clear(); }), rejected, "SENSOR:1"},
      {"empty motion file", lines(kMotion, [](FileLines& l) { l.clear(); }), rejected, "MOTION"},
      {"sensor file without rows", lines(kSensor, [](FileLines& l) { l.resize(1); }), finite},
      {"motion file without rows", lines(kMotion, [](FileLines& l) { l.resize(1); }), rejected},
      {"half of the sensor's rows", lines(kSensor, half_the_lines), finite},
      {"half of the motion's rows", lines(kMotion, half_the_lines), finite},
      {"a sensor's rows twice", lines(kSensor, repeat_lines), either, "repeats that of line"},
      {"the motion's rows twice", lines(kMotion, repeat_lines), survived},
      {"a sensor's rows swapped", lines(kSensor, swap_rows), either, "comes before that of line"},
      {"the motion's rows swapped", lines(kMotion, swap_rows), either, "comes before that of line"},
      {"two readings at the same time", lines(kSensor, other_of_one_time), either, "repeats that of line"},
      {"two poses at the same time", lines(kMotion, other_of_one_time), either, "repeats that of line"},
      {"Windows line ends",
       [](Folder& f) {
         for (auto& [name, all] : f.files) windows_ends(all);
       },
       survived},
      {"byte order marks",
       [](Folder& f) {
         for (auto& [name, all] : f.files) mark_bytes(all);
       },
       survived},
      {"comments and empty lines",
       [](Folder& f) {
         for (auto& [name, all] : f.files) comments(all);
       },
       survived},
      {"missing header", lines(kSensor, [](FileLines& l) { l.erase(l.begin()); }), rejected, "SENSOR:1"},
      {"wrong header", lines(kSensor, [](FileLines& l) { l[0] = "t,north,east"; }), rejected, "SENSOR:1"},
      {"motion file as sensor file", [](Folder& f) { f.sensor_lines() = f.motion_lines(); }, rejected, "SENSOR:"},
      {"sensor file as motion file", [](Folder& f) { f.motion_lines() = f.sensor_lines(); }, rejected, "MOTION:"},
      {"garbage between rows", lines(kSensor, [](FileLines& l) { row(l) = "\x01\x1b[2J\xff,,,"; }), rejected,
       "SENSOR:"},
      {"a row of 100,000 digits", lines(kSensor, [](FileLines& l) { row(l) = std::string(100'000, '7'); }), rejected,
       "SENSOR:"},
      {"nan", cell(kSensor, 1, "nan"), survived},
      {"infinity", cell(kSensor, 1, "-inf"), rejected, "SENSOR:"},
      {"text instead of a number", cell(kSensor, 1, "abc"), rejected, "SENSOR:"},
      {"an empty cell", cell(kSensor, 1, ""), survived},
      {"nan in the motion", cell(kMotion, 1, "nan"), survived},
      {"text instead of a time", cell(kSensor, 0, "noon"), rejected, "SENSOR:"},
      {"a value of 1e3", cell(kSensor, 1, "1e3"), survived},
      {"a value of 1e6", cell(kSensor, 1, "1e6"), survived},
      {"a value of 1e150", cell(kSensor, 1, "1e150"), survived},
      {"a first value of 1e150",
       lines(kSensor,
             [](FileLines& l) {
               l[1].replace(l[1].find(',') + 1, l[1].find(',', l[1].find(',') + 1) - l[1].find(',') - 1, "1e150");
             }),
       finite},
      {"a value of 1e308", cell(kSensor, 1, "1e308"), finite},
      {"1e308 in the motion", cell(kMotion, 1, "1e308"), finite},
      {"1e6 in the motion", cell(kMotion, 1, "1e6"), finite},
      {"1e308 in the truth",
       [](Folder& f) {
         for (auto& [name, all] : f.files)
           if (name.starts_with("truth_")) row(all) = row(all).substr(0, row(all).find(' ')) + " 1e308 0 0 0 0 0 1";
       },
       rejected, "true position 1e+308 m is not plausible"},
      {"one stamp 300 s ahead",
       times(
           kSensor, [](double t) { return t + 300; }, true),
       finite},
      {"one stamp of 1e300", cell(kSensor, 0, "1e300"), rejected},
      {"one stamp of the motion 300 s ahead",
       times(
           kMotion, [](double t) { return t + 300; }, true),
       finite},
      {"a sensor in milliseconds", times(kSensor, [](double t) { return t * 1e3; }), rejected},
      {"a sensor in microseconds", times(kSensor, [](double t) { return t * 1e6; }), rejected},
      {"a sensor in nanoseconds", times(kSensor, [](double t) { return t * 1e9; }), rejected},
      {"all in microseconds", all_times(1e-6), rejected, "seem to be in"},
      {"all in nanoseconds", all_times(1e-9), rejected, "seem to be in"},
      {"a sensor an hour and a minute late", times(kSensor, [](double t) { return t + 3660; }), rejected},
      {"a gap of a day",
       [](Folder& f) {
         FileLines& l = f.motion_lines();
         l.back() = "86400000" + l.back().substr(l.back().find_first_of(", "));
       },
       rejected, "no data for"},
      {"zero quaternion, or text without one",
       lines(kMotion,
             [](FileLines& l) {
               if (is_tum(l[0]) || row(l).find(' ') != std::string::npos)
                 row(l) = row(l).substr(0, row(l).find(' ')) + " 1 2 3 0 0 0 0";
               else
                 row(l) = "x";
             }),
       either, "MOTION:"},
      {"a negative sigma", sigma("-1"), rejected, "scenario.yaml:"},
      {"a sigma of zero", sigma("0"), rejected, "scenario.yaml:"},
      {"a sigma of nan", sigma(".nan"), rejected, "scenario.yaml:"},
      {"text instead of a sigma", sigma("small"), rejected, "scenario.yaml:"},
      {"a sigma of 1e-160", sigma("1e-160"), finite},
      {"unknown key", yaml([](std::string& y) { y += "\nsensros: {}\n"; }), rejected, "scenario.yaml:"},
      {"repeated key", yaml([](std::string& y) { y += "\nname: again\n"; }), rejected, "scenario.yaml:"},
      {"keyframe interval of 0",
       yaml([](std::string& y) { y.replace(y.find("keyframe_interval: 1.0"), 22, "keyframe_interval: 0"); }), rejected,
       "scenario.yaml:"},
      {"keyframe interval of 1e-3 s",
       yaml([](std::string& y) { y.replace(y.find("keyframe_interval: 1.0"), 22, "keyframe_interval: 1e-3"); }),
       rejected, "scenario.yaml:"},
      {"invalid yaml", yaml(minus_first), rejected, "scenario.yaml"},
      {"empty scenario.yaml", yaml([](std::string& y) { y.clear(); }), rejected, "scenario.yaml"},
      {"control characters in the name",
       yaml([](std::string& y) { y.replace(y.find("name: "), 6, "name: \"\\e]0;x\\a\\e[2J\" # "); }), survived},
      {"sensor file outside the folder",
       yaml([](std::string& y) { y += "\nsensors: {far: {type: position, file: ../x.csv, sigma: [1, 1, 1]}}\n"; }),
       rejected, "scenario.yaml:"},
      {"missing motion file", {}, rejected, "MOTION", instead(File::motion, nothing)},
      {"missing scenario.yaml",
       {},
       rejected,
       "scenario.yaml",
       [](const fs::path& folder, const Folder&) { fs::remove(folder / "scenario.yaml"); }},
      {"folder instead of the sensor file", {}, rejected, "SENSOR is a folder", instead(File::sensor, a_folder)},
      {"folder instead of the motion file", {}, rejected, "MOTION is a folder", instead(File::motion, a_folder)},
      {"pipe instead of the sensor file", {}, rejected, "SENSOR is a pipe", instead(File::sensor, a_pipe)},
      {"pipe instead of the motion file", {}, rejected, "MOTION is a pipe", instead(File::motion, a_pipe)},
      {"endless device instead of the sensor file", {}, rejected, "SENSOR", instead(File::sensor, a_device)},
      {"link to itself instead of the sensor file", {}, rejected, "SENSOR", instead(File::sensor, a_loop)},
      {"link to itself instead of the motion file", {}, rejected, "MOTION", instead(File::motion, a_loop)},
  };
  return faults;
}

}  // namespace

Folder::Folder(const fs::path& from, std::string motion_file, std::string sensor_file, double until)
    : motion(std::move(motion_file)), sensor(std::move(sensor_file)) {
  double first = HUGE_VAL;
  for (const auto& entry : fs::directory_iterator(from)) {
    std::ifstream stream(entry.path());
    const std::string name = entry.path().filename();
    for (std::string line; std::getline(stream, line);) {
      if (name == "scenario.yaml")
        yaml += line + "\n";
      else
        files[name].push_back(line);
    }
  }
  for (const std::string& line : files.at(motion))
    if (const auto t = time_of(line)) first = std::min(first, *t);
  for (auto& [name, all] : files)
    std::erase_if(all, [&](const std::string& line) { return time_of(line).value_or(-HUGE_VAL) > first + until; });
}

void Folder::write(const fs::path& to) const {
  std::ofstream(to / "scenario.yaml", std::ios::binary) << yaml;
  for (const auto& [name, all] : files) {
    std::ofstream file(to / name, std::ios::binary);
    for (const std::string& line : all) file << line << "\n";
  }
}

const std::vector<FolderFault>& folder_faults() {
  static const std::vector<FolderFault> faults = make_folder_faults();
  return faults;
}

}  // namespace tandem::faults
