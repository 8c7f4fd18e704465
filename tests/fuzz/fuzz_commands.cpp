#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <optional>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "text_mutation.hpp"

/// Runs the real command line on mutated scenario folders and online feeds. A run must not crash, use more than 20 s of
/// processor time or 4 GB, or exit with a status other than 0, 1 and 2. It must not print control characters. With
/// status 0 it must not write nan or inf.
///
///     fuzz_commands TANDEM SCENARIO VEHICLE COUNT [SEED [SECONDS]]
///
/// SCENARIO is the folder of docking_a, VEHICLE a vehicle file. Run i depends on SEED + i only. No run starts after
/// SECONDS. The input of a failed run is kept in finds/SEED+i in the working directory, and the exit status is then 1.
namespace tandem::fuzz {
namespace {

namespace fs = std::filesystem;
using Words = std::vector<std::string>;
using Files = std::map<std::string, std::string>;  // text by file name

constexpr rlim_t kMaxSeconds = 20, kMaxBytes = rlim_t(4) << 30, kMaxOutput = rlim_t(256) << 20;
constexpr unsigned kMaxWallSeconds = 300;  // ends a run that waits forever, even on a busy machine

std::string read(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

/// Returns the first `lines` lines of a text.
std::string head(const std::string& text, std::size_t lines) {
  std::size_t at = 0;
  for (; lines > 0 && at != std::string::npos; --lines) at = text.find('\n', at + 1);
  return at == std::string::npos ? text : text.substr(0, at + 1);
}

/// The first 30 s of docking_a.
Files docking(const fs::path& from) {
  return {{"scenario.yaml", read(from / "scenario.yaml")},
          {"chaser_odometry.tum", head(read(from / "chaser_odometry.tum"), 302)},
          {"usbl.csv", head(read(from / "usbl.csv"), 4)},
          {"optical.csv", "t,x,y,z,qx,qy,qz,qw\n12.5,5,0,0,0,0,0,1\n13,5,0,0,0,0,0,1\n20,5,0.1,0,0,0,0,1\n"},
          {"truth_chaser.tum", head(read(from / "truth_chaser.tum"), 302)},
          {"truth_target.tum", head(read(from / "truth_target.tum"), 302)}};
}

/// Planar scenario with ranges and bearings, in the NED-FRD frame.
Files planar() {
  Files files;
  files["scenario.yaml"] =
      "name: plane\nframe: NED-FRD\ngroup: SE2\nkeyframe_interval: 1.0\nsensors:\n"
      "  radar: {type: range_bearing, file: radar.csv, sigma: [3.0, 0.03], delay: 0.4}\n"
      "  camera: {type: bearing, file: camera.csv, sigma: [0.03], position: [0.5, 0, 0]}\n"
      "  modem: {type: range, file: modem.csv, sigma: [1.0], loss: cauchy:2}\n"
      "noise:\n  prior: [1.0e-3, 1.0e-3, 1.0e-3]\n  odometry: [0.05, 0.05, 0.001]\n"
      "  constant_twist: [0.5, 0.1, 0.05]\n  constant_velocity: [0.5, 0.5]\n";
  files["radar.csv"] = "t,range,bearing\n";
  files["camera.csv"] = "t,bearing\n";
  files["modem.csv"] = "t,range\n";
  for (int t = 0; t <= 30; ++t) {
    const std::string s = std::to_string(t);
    files["chaser_odometry.tum"] += s + " " + s + " 0 0 0 0 0 1\n";
    files["truth_target.tum"] += s + " " + std::to_string(t + 50) + " 5 0 0 0 0 1\n";
    if (t % 3 == 1) files["radar.csv"] += s + ".2,50.2,0.1\n";
    if (t % 2 == 1) files["camera.csv"] += s + ",0.1\n";
    if (t % 5 == 1) files["modem.csv"] += s + ",50.3\n";
  }
  files["truth_chaser.tum"] = files["chaser_odometry.tum"];
  return files;
}

/// A chaser at rest with its own sensors, without a target.
Files own_sensors() {
  Files files;
  files["scenario.yaml"] =
      "name: own\nlatitude: 60\nkeyframe_interval: 1.0\nsensors:\n"
      "  imu: {type: imu, file: imu.csv, position: [0, 0, 0], accelerometer: 5.0e-4, gyroscope: 1.0e-5, "
      "accelerometer_bias_walk: 1.0e-5, gyroscope_bias_walk: 1.0e-7}\n"
      "  dvl: {type: dvl, file: dvl.csv, sigma: [0.01, 0.01, 0.01]}\n"
      "  depth: {type: depth, file: depth.csv, sigma: [0.05]}\n"
      "  gps: {type: gps, file: gps.csv, sigma: [1, 1, 2]}\n"
      "  heading: {type: heading, file: heading.csv, sigma: [3, 3, 0.01]}\n";
  files["imu.csv"] = "t,fx,fy,fz,wx,wy,wz\n";
  files["dvl.csv"] = "t,vx,vy,vz\n";
  files["depth.csv"] = "t,z\n";
  files["gps.csv"] = "t,x,y,z\n";
  files["heading.csv"] = "t,qx,qy,qz,qw\n";
  for (int i = 0; i <= 200; ++i) files["imu.csv"] += std::to_string(0.1 * i) + ",0,0,9.8,0,0,0\n";
  for (int t = 0; t <= 20; ++t) {
    const std::string s = std::to_string(t);
    files["dvl.csv"] += s + ",0.01,0,0\n";
    files["depth.csv"] += s + ".5,-3\n";
    files["gps.csv"] += s + ",0.1,0.2,-3\n";
    files["heading.csv"] += s + ",0,0,0,1\n";
  }
  return files;
}

/// Returns the rows of all files as lines of an online feed, "NAME,t,…", in time order.
std::string feed_of(const Files& files) {
  std::multimap<double, std::string> lines;
  for (const auto& [file, text] : files) {
    if (file.ends_with(".yaml") || file.starts_with("truth")) continue;
    const std::string name = file == "chaser_odometry.tum" ? "odometry" : file.substr(0, file.find('.'));
    std::istringstream stream(text);
    for (std::string line; std::getline(stream, line);) {
      char* end = nullptr;
      const double t = std::strtod(line.c_str(), &end);
      if (end == line.c_str()) continue;
      std::replace(line.begin(), line.end(), ' ', ',');
      lines.emplace(t, name + "," + line + "\n");
    }
  }
  std::string feed;
  for (const auto& entry : lines) feed += entry.second;
  return feed;
}

struct Run {
  Words words;
  std::optional<fs::path> input;
};

template <class T>
const T& one_of(const std::vector<T>& all, Random& random) {
  return all[random() % all.size()];
}

/// Returns a random command. `own` means that the scenario has only sensors of the chaser.
Run some_run(bool own, const fs::path& folder, Random& random) {
  const std::string run = (folder / "run").string(), out = (folder / "out").string(),
                    vehicle = (folder / "run/vehicle.yaml").string();
  const auto maybe = [&](Words& words, const Words& more) {
    if (random() % 3 == 0) words.insert(words.end(), more.begin(), more.end());
  };
  const unsigned kind = static_cast<unsigned>(random() % 16);
  Run result;
  Words& words = result.words;
  if (kind < 3) {  // track
    const bool stream = kind != 0;
    words = {"track", stream ? (folder / "run/scenario.yaml").string() : run};
    if (stream) words.emplace_back("--stdin");
    if (stream) result.input = folder / "feed";
    maybe(words, {"--robust"});
    maybe(words, {"--json-lines"});
    maybe(words, {"--gate", "off"});
  } else if (own) {
    words = {"navigate", run, "--time-limit", "3", "--plots", "off"};
    maybe(words, {"--no-covariance"});
    maybe(words, {"--loss", "cauchy:2"});
  } else if (kind < 8) {
    words = {"estimate", run, "--time-limit", "3", "--plots", "off"};
    maybe(words, {"--no-covariance"});
    maybe(words, {"--robust"});
    maybe(words, {"--graduated"});
    maybe(words, {"--mode", "B"});
    maybe(words, {"--surge", "0,2.5"});
  } else if (kind == 8) {
    words = {"models", run, "--models", "constant-twist,constant-velocity", "--time-limit", "2", "--plots", "off"};
  } else if (kind == 9) {
    words = {"calibrate", run, "--folds", "0", "--time-limit", "3"};
    maybe(words, {"--json"});
    return result;
  } else if (kind < 12) {
    words = {"compare", run, "--time-limit", "0.3", "--max-keyframes", "8", "--plots", "off"};
    maybe(words, {"--solvers", "gauss-newton,augmented-lagrangian,ipopt"});
    maybe(words, {"--constraints", "hard"});
    maybe(words, {"--robust"});
  } else if (kind < 14) {
    words = {"plan", run, "--at", "15", "--horizon", "5", "--deadline", "300", "--plots", "off"};
    maybe(words, {"--vehicle", vehicle});
    maybe(words, {"--keep-out", "3", "--chance", "2"});
    maybe(words, {"--view", "60"});
    maybe(words, {"--coupled"});
  } else {
    words = {"rendezvous", "--vehicle",  vehicle, "--duration", "12", "--horizon",
             "4",          "--deadline", "200",   "--plots",    "off"};
    maybe(words, {"--methods", "information,coupled,pursuit"});
  }
  if (random() % 2) words.insert(words.end(), {"--out", out});
  maybe(words, {"--json"});
  return result;
}

/// Returns whether a text contains nan or inf as a number.
bool has_nonfinite_number(const std::string& text) {
  for (const std::string word : {"nan", "inf", "-nan", "-inf"})
    for (std::size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + 1)) {
      const std::string around = " \n\t,[]±:";
      const std::size_t end = at + word.size();
      if ((at == 0 || around.find(text[at - 1]) != std::string::npos) &&
          (end == text.size() || around.find(text[end]) != std::string::npos))
        return true;
    }
  return false;
}

bool has_control_byte(const std::string& text) {
  return std::any_of(text.begin(), text.end(), [](char c) { return (c >= 0 && c < ' ' && c != '\n') || c == '\x7f'; });
}

/// Returns a table without its standard deviations, which are inf in unobservable directions.
std::string without_deviations(std::istream& table) {
  std::vector<bool> excluded;
  std::string numbers;
  for (std::string line, cell; std::getline(table, line);) {
    std::istringstream row(line);
    const bool header = excluded.empty();
    for (std::size_t column = 0; std::getline(row, cell, ','); ++column) {
      if (header) excluded.push_back(cell.find("sigma") != std::string::npos);
      if (column >= excluded.size() || !excluded[column]) numbers += cell + ",";
    }
    numbers += "\n";
  }
  return numbers;
}

/// Returns the part of a result file that must be finite. Quaternions of a trajectory are nan if the orientation is
/// unknown.
std::string numbers_of(const fs::path& file) {
  std::istringstream stream(read(file));
  if (file.extension() == ".csv") return without_deviations(stream);
  if (file.extension() != ".tum") return stream.str();
  std::string numbers;
  for (std::string line; std::getline(stream, line);) {
    std::istringstream row(line);
    for (int column = 0; column < 4 && row >> line; ++column) numbers += line + " ";
  }
  return numbers;
}

/// Runs the program and returns its wait status.
int execute(const std::string& tandem, const Run& run, const fs::path& folder) {
  std::vector<char*> argv = {const_cast<char*>(tandem.c_str())};
  for (const std::string& word : run.words) argv.push_back(const_cast<char*>(word.c_str()));
  argv.push_back(nullptr);
  const std::string input = run.input ? run.input->string() : "/dev/null", output = folder / "stdout",
                    errors = folder / "stderr";
  const pid_t child = fork();
  if (child == 0) {
    const auto limit = [](int what, rlim_t most) {
      const rlimit both{most, most};
      setrlimit(static_cast<__rlimit_resource_t>(what), &both);
    };
    limit(RLIMIT_CPU, kMaxSeconds);
    limit(RLIMIT_AS, kMaxBytes);
    limit(RLIMIT_FSIZE, kMaxOutput);
    limit(RLIMIT_CORE, 0);
    alarm(kMaxWallSeconds);
    dup2(open(input.c_str(), O_RDONLY), STDIN_FILENO);
    dup2(open(output.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600), STDOUT_FILENO);
    dup2(open(errors.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600), STDERR_FILENO);
    execv(tandem.c_str(), argv.data());
    _exit(127);
  }
  int status = 0;
  waitpid(child, &status, 0);
  return status;
}

/// Returns the failure of a run, or an empty string.
std::string find_fault(int status, const fs::path& folder) {
  if (WIFSIGNALED(status)) return std::string("killed by signal: ") + strsignal(WTERMSIG(status));
  const int code = WEXITSTATUS(status);
  if (code > 2) return "exit status " + std::to_string(code);
  const std::string output = read(folder / "stdout"), errors = read(folder / "stderr");
  if (has_control_byte(output) || has_control_byte(errors)) return "prints a control character";
  if (code != 0 && errors.empty()) return "status " + std::to_string(code) + " without an error message";
  if (code != 0) return "";
  if (has_nonfinite_number(output)) return "status 0 with nan or inf on standard output";
  if (fs::exists(folder / "out"))
    for (const auto& entry : fs::recursive_directory_iterator(folder / "out"))
      if (entry.is_regular_file() && has_nonfinite_number(numbers_of(entry.path())))
        return "status 0 with nan or inf in " + entry.path().filename().string();
  return "";
}

int run_all(const std::string& tandem, const fs::path& scenario, const fs::path& vehicle, long count,
            unsigned long seed, double seconds) {
  std::vector<Files> bases = {docking(scenario), planar(), own_sensors()};
  for (Files& files : bases) files["vehicle.yaml"] = read(vehicle);
  std::string name = (fs::temp_directory_path() / "tandem-fuzz-XXXXXX").string();
  const fs::path folder = mkdtemp(name.data());
  const auto start = std::chrono::steady_clock::now();
  std::map<int, long> by_status;
  long runs = 0, finds = 0;
  for (; runs < count; ++runs) {
    if (std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count() > seconds) break;
    const unsigned long number = seed + static_cast<unsigned long>(runs);
    Random random(number);
    for (const auto& entry : fs::directory_iterator(folder)) fs::remove_all(entry.path());
    fs::create_directory(folder / "run");
    const std::size_t base = random() % bases.size();
    Files files = bases[base];
    files["feed"] = feed_of(files);
    const Run run = some_run(base == 2, folder, random);
    const bool is_feed = run.input.has_value(),
               by_vehicle = std::find(run.words.begin(), run.words.end(), "--vehicle") != run.words.end();
    for (auto n = random() % 2 ? 1 : 1 + random() % 3; n > 0; --n) {
      auto file = std::next(files.begin(), std::ptrdiff_t(random() % files.size()));
      if (is_feed && random() % 4) file = files.find("feed");
      if (by_vehicle && random() % 2) file = files.find("vehicle.yaml");
      const std::string before = file->second;
      mutate(file->second, random);
      // Undoes mutations that put nan or inf into a YAML file, because they may be names, which are printed. As numbers
      // they would be .nan and .inf.
      if (file->first.ends_with(".yaml") && has_nonfinite_number(file->second)) file->second = before;
    }
    for (const auto& [file, text] : files)
      std::ofstream(file == "feed" ? folder / "feed" : folder / "run" / file, std::ios::binary) << text;
    const int status = execute(tandem, run, folder);
    if (WIFEXITED(status)) ++by_status[WEXITSTATUS(status)];
    const std::string why = find_fault(status, folder);
    if (why.empty()) continue;
    ++finds;
    std::printf("%lu: %s:", number, why.c_str());
    for (const std::string& word : run.words) std::printf(" %s", word.c_str());
    std::printf("\n");
    std::fflush(stdout);
    const fs::path kept = fs::path("finds") / std::to_string(number);
    fs::create_directories("finds");
    fs::remove_all(kept);
    fs::copy(folder, kept, fs::copy_options::recursive);
  }
  fs::remove_all(folder);
  std::printf("%ld runs, %ld finds; status", runs, finds);
  for (const auto& [status, n] : by_status) std::printf(" %d: %ld", status, n);
  std::printf("\n");
  return finds > 0 ? 1 : 0;
}

}  // namespace
}  // namespace tandem::fuzz

int main(int argc, char** argv) {
  if (argc < 5 || argc > 7) {
    std::fprintf(stderr, "Usage: fuzz_commands TANDEM SCENARIO VEHICLE COUNT [SEED [SECONDS]]\n");
    return 2;
  }
  const unsigned long seed = argc > 5 ? std::strtoul(argv[5], nullptr, 10) : 1;
  return tandem::fuzz::run_all(argv[1], argv[2], argv[3], std::strtol(argv[4], nullptr, 10), seed,
                               argc > 6 ? std::strtod(argv[6], nullptr) : HUGE_VAL);
}
