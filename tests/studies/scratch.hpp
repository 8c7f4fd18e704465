#pragma once

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <stdlib.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/support/output_folder.hpp>

namespace tandem {

/// A temporary folder, removed by the destructor.
class ScratchFolder {
 public:
  ScratchFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "tandem-test-XXXXXX").string();
    path_ = mkdtemp(name.data());
  }
  ~ScratchFolder() { std::filesystem::remove_all(path_); }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path write(const std::string& file, const std::string& text) const {
    std::ofstream(path_ / file, std::ios::binary) << text;
    return path_ / file;
  }

 private:
  std::filesystem::path path_;
};

/// Sets the environment variable PATH for its lifetime.
class Path {
 public:
  explicit Path(const std::string& value) : before_(getenv("PATH")) { setenv("PATH", value.c_str(), 1); }
  ~Path() { setenv("PATH", before_.c_str(), 1); }
  Path(const Path&) = delete;
  Path& operator=(const Path&) = delete;

 private:
  std::string before_;
};

/// Returns the names of the entries of a folder, without the manifest of OutputFolder.
inline std::vector<std::string> files(const std::filesystem::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    if (const std::string name = entry.path().filename(); name != OutputFolder::manifest) names.push_back(name);
  return names;
}

inline std::string read_file(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  EXPECT_TRUE(stream) << file << " is missing";
  return {std::istreambuf_iterator<char>(stream), {}};
}

/// Returns the message of the Error that f() throws. Fails if it throws none.
template <class F>
std::string error_of(F f) {
  try {
    f();
  } catch (const Error& error) {
    return error.what();
  }
  ADD_FAILURE() << "no Error was thrown";
  return "";
}

/// Writes a scenario of five seconds. The target stays 5 m ahead of the chaser on a straight line at 1 m/s; all
/// measurements are exact.
inline void write_small_scenario(const ScratchFolder& folder) {
  folder.write("scenario.yaml",
               "name: small\n"
               "description: A straight line\n"
               "source: by hand\n"
               "keyframe_interval: 1.0\n"
               "noise:\n"
               "  prior: [1.0e-3, 1.0e-3, 1.0e-3, 1.0e-3, 1.0e-3, 1.0e-3]\n"
               "  odometry: [0.01, 0.01, 0.01, 0.001, 0.001, 0.001]\n"
               "  usbl: [1.0, 1.0, 1.0]\n"
               "  optical: [0.1, 0.1, 0.1, 0.04, 0.04, 0.04]\n"
               "  constant_twist: [0.1, 0.1, 0.1, 0.02, 0.02, 0.02]\n");
  std::string chaser = "# t x y z qx qy qz qw\n", target;
  for (int t = 0; t <= 5; ++t) {
    chaser += std::to_string(t) + " " + std::to_string(t) + " 0 0 0 0 0 1\n";
    target += std::to_string(t) + " " + std::to_string(t + 5) + " 0 0 0 0 0 1\n";
  }
  folder.write("chaser_odometry.tum", chaser);
  folder.write("truth_chaser.tum", chaser);
  folder.write("truth_target.tum", target);
  folder.write("usbl.csv", "t,x,y,z\n1,5,0,0\n4.5,5,0,0\n");
  folder.write("optical.csv", "t,x,y,z,qx,qy,qz,qw\n2,5,0,0,0,0,0,1\n3,5,0,0,0,0,0,1\n");
}

}  // namespace tandem
