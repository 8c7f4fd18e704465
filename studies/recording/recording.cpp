#include <algorithm>
#include <array>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/recording/recording.hpp>
#include <tandem/studies/recording/recording_formats.hpp>
#include <tandem/studies/support/input_file.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

namespace fs = std::filesystem;

/// The recordings of several files: a table for each sensor, or the parts of a bag, whose topics are joined.
class RecordingSet : public Recording {
 public:
  RecordingSet(const fs::path& folder, std::vector<std::unique_ptr<Recording>> parts) : parts_(std::move(parts)) {
    file_ = folder;
    for (std::size_t p = 0; p < parts_.size(); ++p) {
      if (format_.find(parts_[p]->format()) == std::string::npos)
        format_ += (format_.empty() ? "" : ", ") + parts_[p]->format();
      for (const RecordedStream& stream : parts_[p]->streams()) add(p, stream);
      for (const std::string& defect : parts_[p]->defects()) add_defect_of(p, defect);
    }
  }

  void read(const std::vector<RowRequest>& requests, const std::function<void()>& stop) override {
    for (std::size_t p = 0; p < parts_.size(); ++p) {
      std::vector<RowRequest> of_part;
      for (const RowRequest& request : requests)
        for (const Source& source : sources_)
          if (source.part == p && streams_[source.stream].name == request.stream) {
            of_part.push_back(request);
            of_part.back().stream = source.name;
          }
      if (of_part.empty()) continue;
      const std::size_t before = parts_[p]->defects().size();
      parts_[p]->read(of_part, stop);
      for (std::size_t d = before; d < parts_[p]->defects().size(); ++d) add_defect_of(p, parts_[p]->defects()[d]);
    }
  }

 private:
  /// A stream of a part, and the stream of the set that it belongs to.
  struct Source {
    std::size_t part, stream;
    std::string name;  ///< in the part
  };

  void add(std::size_t part, const RecordedStream& added) {
    const auto same_name =
        std::find_if(streams_.begin(), streams_.end(), [&](const RecordedStream& s) { return s.name == added.name; });
    if (same_name != streams_.end() && same_name->type == added.type && !added.type.empty()) {
      same_name->rows += added.rows;
      if (!(same_name->first <= added.first)) same_name->first = added.first;
      if (!(same_name->last >= added.last)) same_name->last = added.last;
      sources_.push_back({part, static_cast<std::size_t>(same_name - streams_.begin()), added.name});
      return;
    }
    const bool taken = same_name != streams_.end();
    streams_.push_back(added);
    if (taken) streams_.back().name = parts_[part]->file().filename().string() + ":" + added.name;
    sources_.push_back({part, streams_.size() - 1, added.name});
  }

  void add_defect_of(std::size_t part, const std::string& defect) {
    add_defect(parts_[part]->file().filename().string() + ": " + defect);
  }

  std::vector<std::unique_ptr<Recording>> parts_;
  std::vector<Source> sources_;
};

std::string first_bytes(const fs::path& file, std::size_t n) {
  InputFile stream(file);
  std::string bytes(n, '\0');
  stream.read(bytes.data(), static_cast<std::streamsize>(n));
  bytes.resize(static_cast<std::size_t>(stream.gcount()));
  return bytes;
}

/// Returns whether a file of an unknown format is a text. Damage, such as the zeros that a logger leaves when it loses
/// power, does not make a text a binary file: its first line, or 95 % of its bytes, are text.
bool is_text(std::string_view head) {
  constexpr std::size_t kMinLine = 8, kLargestShare = 20;
  const auto is_control = [](char c) {
    const auto byte = static_cast<unsigned char>(c);
    return byte < 9 || (byte > 13 && byte < 32 && byte != 27);
  };
  const std::string_view line = head.substr(0, head.find('\n'));
  return (line.size() >= kMinLine && std::none_of(line.begin(), line.end(), is_control)) ||
         kLargestShare * static_cast<std::size_t>(std::count_if(head.begin(), head.end(), is_control)) < head.size();
}

bool has_nmea_sentence(const std::string& head) {
  for (std::size_t at = head.find('$'); at != std::string::npos; at = head.find('$', at + 1)) {
    const std::size_t comma = head.find(',', at), line = head.find('\n', at);
    if (comma == std::string::npos || comma - at < 5 || comma - at > 9 || comma > line) continue;
    if (std::all_of(head.begin() + static_cast<long>(at) + 1, head.begin() + static_cast<long>(comma),
                    [](char c) { return (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9'); }))
      return true;
  }
  return false;
}

bool has_json_lines(std::string_view head) {
  const std::size_t at = head.find_first_not_of(" \t\r\n");
  return at != std::string_view::npos && head[at] == '{';
}

/// Returns "poses[].x" for "poses[3].x".
std::string without_indices(const std::string& name) {
  std::string result;
  bool index = false;
  for (const char c : name) {
    index = index && c != ']';
    if (!index) result += c;
    index = index || c == '[';
  }
  return result;
}

/// Returns "x" for the column names "x [m]", "x (m)" and "x []"; other names as they are.
std::string_view without_unit(std::string_view name) {
  for (const auto& [open, close] : {std::pair{'[', ']'}, {'(', ')'}, {'{', '}'}}) {
    const std::size_t begin = name.rfind(open);
    if (!name.ends_with(close) || begin == std::string_view::npos || begin == 0) continue;
    if (!parse_number(trimmed(name.substr(begin + 1, name.size() - begin - 2)))) return trimmed(name.substr(0, begin));
  }
  return name;
}

std::unique_ptr<Recording> open_file(const fs::path& file, const TableSettings& tables) {
  const std::string head = first_bytes(file, 4096);
  if (head.empty()) throw Error(fmt::format("{} is empty", file.string()));
  const std::string_view start = head;
  for (const RecordingFormat& format : recording_formats())
    if (start.starts_with(format.magic)) return format.open(file);
  for (const std::string& why : {why_compressed(start), why_unreadable(start)})
    if (!why.empty()) throw Error(fmt::format("{}: {}", file.string(), why));
  if (!is_text(head))
    throw Error(fmt::format("{}: unknown format (first bytes {}); readable are {}", file.string(),
                            quote(start.substr(0, 8)), readable_formats()));
  if (has_json_lines(head)) return open_json_lines(file);
  if (has_nmea_sentence(head) && !tables.delimiter) return open_nmea(file);
  return open_table(file, tables);
}

std::unique_ptr<Recording> open_folder(const fs::path& folder, const TableSettings& tables) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder))
    if (entry.is_regular_file() && !entry.path().filename().string().starts_with('.')) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  std::vector<std::unique_ptr<Recording>> parts;
  for (const fs::path& file : files)
    if (is_recording_name(file)) parts.push_back(open_file(file, tables));
  for (const fs::path& file : files)  // a bag of rosbag2's compression mode FILE
    if (const std::string why = parts.empty() ? why_compressed(first_bytes(file, 8)) : ""; !why.empty())
      throw Error(fmt::format("{}: {}", file.string(), why));
  if (parts.empty())
    throw Error(fmt::format("{} has no recording; readable are {}", folder.string(), readable_formats()));
  if (parts.size() == 1) return std::move(parts.front());
  return std::make_unique<RecordingSet>(folder, std::move(parts));
}

}  // namespace

const RecordedStream* Recording::find(std::string_view name) const {
  for (const RecordedStream& stream : streams_)
    if (stream.name == name) return &stream;
  return nullptr;
}

void Recording::add_defect(std::string sentence) {
  if (std::find(defects_.begin(), defects_.end(), sentence) == defects_.end()) defects_.push_back(std::move(sentence));
}

std::unique_ptr<Recording> open_recording(const fs::path& path, const TableSettings& tables) {
  if (!fs::exists(path)) throw Error(fmt::format("{} is missing", path.string()));
  return fs::is_directory(path) ? open_folder(path, tables) : open_file(path, tables);
}

const RecordedField* find_field(const RecordedStream& stream, const std::string& name) {
  for (const RecordedField& field : stream.fields)
    if (field.name == name) return &field;
  if (const auto number = parse_positive_integer(name);
      number && stream.type.empty() && static_cast<std::size_t>(*number) <= stream.fields.size())
    return &stream.fields[static_cast<std::size_t>(*number) - 1];
  if (stream.type.empty()) {  // a column with its unit, if it is the only one of this name
    const auto same = [&](const RecordedField& f) { return without_unit(f.name) == name; };
    const auto found = std::find_if(stream.fields.begin(), stream.fields.end(), same);
    if (found != stream.fields.end() && std::find_if(found + 1, stream.fields.end(), same) == stream.fields.end())
      return &*found;
  }
  if (name.find('[') == std::string::npos) return nullptr;
  const std::string wanted = without_indices(name);
  for (const RecordedField& field : stream.fields)
    if (field.name.find('[') != std::string::npos && without_indices(field.name) == wanted) return &field;
  return nullptr;
}

std::string unknown_field(const RecordedStream& stream, const std::string& field) {
  std::vector<std::string> names;
  for (const RecordedField& f : stream.fields) names.push_back(f.name);
  std::vector<std::string> texts = names;
  std::erase_if(texts, [](const std::string& n) { return parse_positive_integer(n).has_value(); });  // column numbers
  const std::string similar = did_you_mean(field, texts);
  constexpr std::size_t kShown = 12;
  const std::size_t n = names.size();
  if (n > kShown) names.resize(kShown);
  return fmt::format("{} has no field {}{} (fields: {}{})", stream.name, quote(field), similar, fmt::join(names, ", "),
                     n > kShown ? fmt::format(", … {} in total", n) : "");
}

std::vector<std::size_t> field_indices(const RecordedStream& stream, const std::vector<std::string>& fields) {
  std::vector<std::size_t> indices;
  for (const std::string& field : fields) {
    const auto at = std::find_if(stream.fields.begin(), stream.fields.end(),
                                 [&](const RecordedField& f) { return f.name == field; });
    if (at == stream.fields.end()) throw Error(unknown_field(stream, field));
    indices.push_back(static_cast<std::size_t>(at - stream.fields.begin()));
  }
  return indices;
}

}  // namespace tandem
