#include <map>

#include <fmt/format.h>
#include <sqlite3.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/recording/byte_reader.hpp>
#include <tandem/studies/recording/file_bytes.hpp>
#include <tandem/studies/recording/message_recording.hpp>
#include <tandem/studies/recording/recording_formats.hpp>

namespace tandem {
namespace {

constexpr int kStopInterval = 1024;    // messages
constexpr std::uint64_t kHeader = 32;  // read bytes of the header of a database

/// A statement of SQLite with the rows of its result.
class Query {
 public:
  Query(sqlite3* database, const std::string& sql) : database_(database) {
    if (sqlite3_prepare_v2(database, sql.c_str(), -1, &statement_, nullptr) != SQLITE_OK) statement_ = nullptr;
  }
  ~Query() { sqlite3_finalize(statement_); }
  Query(const Query&) = delete;

  bool valid() const { return statement_ != nullptr; }
  /// Moves to the next row. Returns false at the end and after an error; see failed().
  bool next() {
    const int status = valid() ? sqlite3_step(statement_) : SQLITE_ERROR;
    failed_ = status != SQLITE_ROW && status != SQLITE_DONE;
    return status == SQLITE_ROW;
  }
  bool failed() const { return failed_; }
  std::string reason() const { return sqlite3_errmsg(database_); }
  long long integer(int column) const { return sqlite3_column_int64(statement_, column); }
  std::string_view bytes(int column) const {
    const auto* data = static_cast<const char*>(sqlite3_column_blob(statement_, column));
    return {data ? data : "", static_cast<std::size_t>(sqlite3_column_bytes(statement_, column))};
  }
  std::string text(int column) const { return std::string(bytes(column)); }

 private:
  sqlite3* database_;
  sqlite3_stmt* statement_ = nullptr;
  bool failed_ = false;
};

/// A database file of rosbag2 (tables topics and messages).
class Rosbag2Recording : public MessageRecording {
 public:
  explicit Rosbag2Recording(const std::filesystem::path& file) {
    file_ = file;
    format_ = "ROS 2 bag";
    // Immutable: read without locks, and without a journal beside a file that may be read-only.
    const std::string uri = "file:" + escaped(std::filesystem::absolute(file).string()) + "?immutable=1";
    check_length();
    if (sqlite3_open_v2(uri.c_str(), &database_, SQLITE_OPEN_READONLY | SQLITE_OPEN_URI, nullptr) != SQLITE_OK) fail();
    // SQLite reads a file that is shorter than its header says only with this setting.
    sqlite3_exec(database_, "PRAGMA writable_schema=ON", nullptr, nullptr, nullptr);
    list_topics();
    count_messages();
  }
  ~Rosbag2Recording() override { sqlite3_close(database_); }

 protected:
  void read_messages(const std::function<void()>& stop) override {
    std::string ids;
    for (const auto& [id, topic] : topic_of_)
      if (is_wanted(topic)) ids += fmt::format("{}{}", ids.empty() ? "" : ",", id);
    Query messages(database_, fmt::format("SELECT topic_id, timestamp, data, id FROM messages WHERE topic_id IN ({}) "
                                          "ORDER BY id",
                                          ids));
    long long last = 0;
    int n = 0;
    while (messages.next()) {
      if (++n % kStopInterval == 0) stop();
      last = messages.integer(3);
      receive(topic_of_.at(messages.integer(0)), 1e-9 * static_cast<double>(messages.integer(1)), messages.bytes(2));
    }
    if (messages.failed())
      add_defect(fmt::format("the database is damaged after message {} ({}); the {} messages before are used", last,
                             messages.reason(), n));
  }

 private:
  static std::string escaped(const std::string& path) {
    std::string uri;
    for (const char c : path)
      if (c == '%' || c == '?' || c == '#')
        uri += fmt::format("%{:02X}", static_cast<unsigned char>(c));
      else
        uri += c;
    return uri;
  }

  [[noreturn]] void fail() {
    const std::string reason = sqlite3_errmsg(database_);
    sqlite3_close(database_);
    throw Error(fmt::format("{}: not a readable ROS 2 bag: {}", file_.string(), reason));
  }

  /// Adds a defect if the file ends before its last page.
  void check_length() {
    FileBytes bytes(file_);
    if (bytes.size() < kHeader) return;  // opening it has failed
    ByteReader header(bytes.read(0, kHeader), true);
    header.skip(16);
    const std::uint64_t page = header.u16();
    header.skip(10);
    const std::uint64_t size = bytes.size(), length = (page == 1 ? 65536 : page) * header.u32();
    if (size < length)
      add_defect(
          fmt::format("the file is truncated: it ends at byte {} of {}; the messages before are used", size, length));
  }

  void list_topics() {
    std::map<std::string, std::string> definitions;
    Query embedded(database_, "SELECT topic_type, encoded_message_definition, encoding FROM message_definitions");
    while (embedded.next())
      if (embedded.text(2) != "ros2idl") definitions[embedded.text(0)] = embedded.text(1);
    Query topics(database_, "SELECT id, name, type, serialization_format FROM topics");
    if (!topics.valid()) fail();
    while (topics.next()) {
      topic_of_[topics.integer(0)] = this->topics();
      add_topic(topics.text(1), topics.text(2), topics.text(3), definitions[topics.text(2)]);
    }
    if (topics.failed()) fail();
  }

  void count_messages() {
    Query counts(database_,
                 "SELECT topic_id, count(*), min(timestamp), max(timestamp) FROM messages GROUP BY topic_id");
    while (counts.next()) {
      const auto topic = topic_of_.find(counts.integer(0));
      if (topic == topic_of_.end()) continue;
      RecordedStream& stream = streams_[topic->second];
      stream.rows = static_cast<std::size_t>(counts.integer(1));
      stream.first = 1e-9 * static_cast<double>(counts.integer(2));
      stream.last = 1e-9 * static_cast<double>(counts.integer(3));
    }
    if (!counts.failed()) return;
    // A damaged table cannot be counted; read_messages() uses the rows that it can read.
    add_defect(fmt::format("the database is damaged ({}); rows are not counted", counts.reason()));
    Query messages(database_, "SELECT topic_id, timestamp FROM messages ORDER BY id");
    while (messages.next())
      if (const auto topic = topic_of_.find(messages.integer(0)); topic != topic_of_.end())
        count(topic->second, 1e-9 * static_cast<double>(messages.integer(1)));
  }

  sqlite3* database_ = nullptr;
  std::map<long long, std::size_t> topic_of_;  ///< key: ID in the database
};

}  // namespace

std::unique_ptr<Recording> open_rosbag2(const std::filesystem::path& file) {
  return std::make_unique<Rosbag2Recording>(file);
}

}  // namespace tandem
