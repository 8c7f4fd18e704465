#pragma once

#include <algorithm>
#include <random>
#include <string>
#include <utility>
#include <vector>

namespace tandem::fuzz {

using Random = std::mt19937_64;

/// Returns begin and end of a random word between separators of CSV, TUM and YAML; {n, n} if there is none.
inline std::pair<std::size_t, std::size_t> some_token(const std::string& text, Random& random) {
  const std::string separators = " ,:\n[]{}\t";
  if (text.empty()) return {0, 0};
  const std::size_t from = text.find_first_not_of(separators, random() % text.size());
  if (from == std::string::npos) return {text.size(), text.size()};
  const std::size_t begin = text.find_last_of(separators, from);
  return {begin == std::string::npos ? 0 : begin + 1, std::min(text.find_first_of(separators, from), text.size())};
}

/// Returns begin and end of a random line.
inline std::pair<std::size_t, std::size_t> some_line(const std::string& text, Random& random) {
  if (text.empty()) return {0, 0};
  const std::size_t at = random() % text.size(), end = text.find('\n', at);
  const std::size_t begin = at == 0 ? std::string::npos : text.rfind('\n', at - 1);
  return {begin == std::string::npos ? 0 : begin + 1, end == std::string::npos ? text.size() : end + 1};
}

/// Makes a random mistake of the kind that occurs in files: in bytes, words, numbers or lines.
inline void mutate(std::string& text, Random& random) {
  static const std::vector<std::string> numbers = {"0",      "-0",    "-1",  "1e-320",     "1e308",
                                                   "-1e308", "1e150", "1e9", "1e18",       "1000",
                                                   "-200",   "0.5",   "1e6", "4294967296", "1e-12"};
  static const std::vector<std::string> words = {
      ".nan",      "nan",     "inf",      "-inf",     "1e400",   "abc",           "",
      "\"",        "'",       "~",        "*a",       "&a",      "!!x",           "../..",
      "/dev/zero", "\x1b[2J", "\xff\xfe", "position", "pose",    "range_bearing", "bearing",
      "range",     "imu",     "dvl",      "depth",    "gps",     "heading",       "usbl",
      "optical",   "SE2",     "SE3",      "NED-FRD",  "sensors", "noise",         "sigma",
      "error",     "cauchy:0"};
  const auto at = [&] { return text.empty() ? 0 : random() % text.size(); };
  switch (random() % 13) {
    case 0:
      if (!text.empty()) text[at()] = static_cast<char>(random());
      break;
    case 1:
      text.insert(at(), std::string(1 + random() % 8, static_cast<char>(random())));
      break;
    case 2:
      text.erase(at(), 1 + random() % 64);
      break;
    case 3:
      text.resize(at());
      break;
    case 4: {  // repeats a line
      const auto [from, to] = some_line(text, random);
      text.insert(from, text.substr(from, to - from));
      break;
    }
    case 5: {
      const auto [from, to] = some_line(text, random);
      text.erase(from, to - from);
      break;
    }
    case 6: {  // moves a line
      const auto [from, to] = some_line(text, random);
      const std::string line = text.substr(from, to - from);
      text.erase(from, to - from);
      text.insert(some_line(text, random).first, line);
      break;
    }
    case 7:
    case 8:
    case 9:
    case 10: {
      const auto [from, to] = some_token(text, random);
      const std::vector<std::string>& by = random() % 4 ? numbers : words;
      text.replace(from, to - from, by[random() % by.size()]);
      break;
    }
    case 11: {  // changes the power of ten
      const auto [from, to] = some_token(text, random);
      text.insert(to, "e" + std::to_string(int(random() % 40) - 20));
      break;
    }
    default: {  // replaces a word by another one
      const auto [from, to] = some_token(text, random);
      const std::string word = text.substr(from, to - from);
      const auto [there, end] = some_token(text, random);
      text.replace(there, end - there, word);
    }
  }
}

}  // namespace tandem::fuzz
