#pragma once

#include <string>
#include <vector>

#include <tandem/studies/recording/recording.hpp>

namespace tandem {

/// A row as a test compares it: receive time, numbers and texts.
struct TestRow {
  double received;
  std::vector<double> numbers;
  std::vector<std::string> texts;
};

inline std::vector<TestRow> read_rows(Recording& recording, const std::string& stream,
                                      const std::vector<std::string>& fields) {
  std::vector<TestRow> rows;
  recording.read({{stream, fields,
                   [&](const RecordedRow& row) {
                     TestRow read{row.received, {}, {}};
                     for (const RecordedValue& v : row.values) {
                       read.numbers.push_back(v.number);
                       read.texts.emplace_back(v.text);
                     }
                     rows.push_back(read);
                   }}},
                 [] {});
  return rows;
}

}  // namespace tandem
