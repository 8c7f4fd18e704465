#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <vector>

#include "fuzz/input.hpp"

// Runs a fuzz target on each file of a folder once, for compilers without libFuzzer. Fails if no file is valid input.
//   replay_TARGET FOLDER
int main(int count, char** arguments) {
  if (count != 2) {
    std::cerr << "Usage: " << arguments[0] << " FOLDER\n";
    return 2;
  }
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(arguments[1])) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  for (const std::filesystem::path& file : files) {
    std::cout << file.filename().string() << std::endl;  // before the run, which may crash
    std::ifstream stream(file, std::ios::binary);
    const std::string bytes{std::istreambuf_iterator<char>(stream), {}};
    LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
  }
  if (files.empty()) std::cerr << arguments[1] << " contains no file\n";
  using tandem::fuzz::accepted, tandem::fuzz::rejected;
  std::cout << accepted << " inputs accepted, " << rejected << " rejected\n";
  const bool outdated = accepted == 0 && rejected > 0;
  if (outdated) std::cerr << arguments[1] << " has no valid input; was the format changed?\n";
  return files.empty() || outdated ? 1 : 0;
}
