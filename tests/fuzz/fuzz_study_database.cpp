#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>

#include <stdlib.h>

#include <tandem/studies/study/study_database.hpp>
#include <tandem/studies/study/study_report.hpp>
#include <tandem/studies/study/study_tables.hpp>

#include "fuzz/input.hpp"
#include "studies/study/small_study.hpp"

namespace {

using namespace tandem;
namespace fs = std::filesystem;

/// A folder in memory, removed at the end of the program.
struct Folder {
  Folder() {
    std::string name = (fs::is_directory("/dev/shm") ? "/dev/shm" : "/tmp") + std::string("/tandem-fuzz-XXXXXX");
    fuzz::expect(mkdtemp(name.data()) != nullptr, "a folder is created");
    path = name;
  }
  ~Folder() { fs::remove_all(path); }
  fs::path path;
};

template <class T>
T taken(fuzz::Input& input) {
  std::array<std::uint8_t, sizeof(T)> bytes;
  for (std::uint8_t& byte : bytes) byte = input.byte();
  T value;
  std::memcpy(&value, bytes.data(), sizeof value);
  return value;
}

/// Adds rows with any trial number, status and values.
void add_rows(StudyDatabase& database, fuzz::Input& input) {
  while (!input.empty()) {
    TrialResult result;
    const std::uint8_t kind = input.byte();
    result.trial = kind & 1 ? taken<std::size_t>(input) : input.byte();
    result.status = kind & 2 ? "converged" : std::string(1, static_cast<char>(input.byte()));
    result.message = kind & 4 ? "\x1b[2J" : "";
    for (int i = 0; i < (kind >> 4); ++i) result.metrics[input.below(result.metrics.size())] = taken<double>(input);
    database.add(result);
  }
}

/// Returns the bytes of a database with two trials.
std::string small_database(const fs::path& folder) {
  {
    StudyDatabase database = StudyDatabase::create(folder, small_study(), kSmallStudy);
    TrialResult result;
    for (result.trial = 0; result.trial < 2; ++result.trial) {
      result.status = "converged";
      result.set("at_all_error_m", 1.5);
      database.add(result);
    }
  }
  std::ifstream stream(folder / StudyDatabase::file_name, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

}  // namespace

// The database of a study. The first byte selects the meaning of the others: rows, changes of single bytes of a valid
// file, or the whole file. A change has four bytes: three for the place and one for the new value.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const Folder folder;
  static const std::string valid = small_database(folder.path);
  fuzz::Input input(data, size);
  const std::size_t kind = input.below(3);
  for (const auto& entry : fs::directory_iterator(folder.path)) fs::remove(entry.path());
  std::string bytes = valid;
  if (kind == 1)
    while (!input.empty()) {
      const std::size_t place = std::size_t(input.byte()) << 16 | std::size_t(input.byte()) << 8 | input.byte();
      bytes[place % bytes.size()] = static_cast<char>(input.byte());
    }
  if (kind == 2) bytes = input.text();
  std::ofstream(folder.path / StudyDatabase::file_name, std::ios::binary) << bytes;
  fuzz::accepts([&] {
    if (kind == 0) {
      StudyDatabase database = StudyDatabase::resume(folder.path, small_study());
      add_rows(database, input);
    }
    const StudyDatabase database = StudyDatabase::read(folder.path);
    const std::vector<TrialResult> results = database.results();
    fuzz::expect(database.finished().size() == database.study().trials(), "each trial is finished or not");
    for (const TrialResult& result : results)
      fuzz::expect(result.trial < database.study().trials(), "a trial is one of the study");
    fuzz::expect(!study_report(database.study(), study_tables(database.study(), results)).empty(), "a report has text");
  });
  return 0;
}
