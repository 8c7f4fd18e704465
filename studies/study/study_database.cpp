#include <cerrno>
#include <cmath>
#include <cstring>

#include <fmt/format.h>
#include <sqlite3.h>
#include <unistd.h>

#include <tandem/lie/error.hpp>
#include <tandem/problem/regular_file.hpp>
#include <tandem/problem/stop.hpp>
#include <tandem/studies/study/study_database.hpp>
#include <tandem/studies/support/console.hpp>
#include <tandem/studies/support/file_lock.hpp>
#include <tandem/studies/support/input_file.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

constexpr const char* kFormat = "2";
constexpr int kBusy = 10000;            // ms to wait for a reader
constexpr std::size_t kRowBytes = 700;  // reserved per trial, an upper bound
constexpr int kInstructions = 10000;    // SQLite instructions between two calls of interrupted(), below 1 ms
constexpr const char* kLock = "study.lock";

/// Locks a folder for one writer. Throws Error if that fails.
std::unique_ptr<FileLock> writer_lock(const std::filesystem::path& folder) {
  auto lock = std::make_unique<FileLock>(folder / kLock, FileLock::Busy::give_up);
  if (lock->failure() == 0) return lock;
  if (lock->failure() == EWOULDBLOCK)
    throw Error(fmt::format("{}: another process is running this study; wait for it or stop it", folder.string()));
  throw Error(fmt::format("{} cannot be written: {}", (folder / kLock).string(), std::strerror(lock->failure())));
}

class Database;

/// A prepared statement.
class Statement {
 public:
  Statement(const Database& database, const std::string& sql);
  ~Statement() { sqlite3_finalize(statement_); }
  Statement(const Statement&) = delete;
  Statement& operator=(const Statement&) = delete;

  void bind(int i, const std::string& text) {
    sqlite3_bind_text(statement_, i, text.data(), static_cast<int>(text.size()), SQLITE_TRANSIENT);
  }
  void bind(int i, std::size_t number) { sqlite3_bind_int64(statement_, i, static_cast<sqlite3_int64>(number)); }
  void bind(int i, const std::optional<double>& number) {
    number ? sqlite3_bind_double(statement_, i, *number) : sqlite3_bind_null(statement_, i);
  }
  bool step();  ///< returns whether there is a row
  /// Returns a value as text; as SQLite does, without changing its type.
  std::string text(int i) const {
    const auto* const bytes = reinterpret_cast<const char*>(sqlite3_column_text(statement_, i));
    return bytes ? std::string(bytes, std::size_t(sqlite3_column_bytes(statement_, i))) : "";
  }
  /// Returns an integer. Throws Error unless it is at least `least` and below `end`.
  std::size_t whole(int i, std::size_t least, std::size_t end) const;
  /// Returns a finite number or NULL. Throws Error on another value.
  std::optional<double> number(int i) const;

 private:
  const Database& database_;
  sqlite3_stmt* statement_ = nullptr;
};

class Database {
 public:
  Database(std::filesystem::path file, int flags) : file_(std::move(file)) {
    check(sqlite3_open_v2(file_.c_str(), &handle_, flags | SQLITE_OPEN_NOMUTEX, nullptr));
    sqlite3_busy_timeout(handle_, kBusy);
    // The schema of an untrusted database may call functions and have triggers.
    sqlite3_db_config(handle_, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
    sqlite3_db_config(handle_, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
    sqlite3_db_config(handle_, SQLITE_DBCONFIG_ENABLE_TRIGGER, 0, nullptr);
  }
  ~Database() { sqlite3_close(handle_); }
  Database(const Database&) = delete;
  Database& operator=(const Database&) = delete;

  void run(const std::string& sql) const { check(sqlite3_exec(handle_, sql.c_str(), nullptr, nullptr, nullptr)); }
  sqlite3* handle() const { return handle_; }

  /// Throws Error if `code` is an SQLite failure.
  void check(int code) const {
    switch (code & 0xff) {
      case SQLITE_OK:
      case SQLITE_ROW:
      case SQLITE_DONE:
        return;
      case SQLITE_CORRUPT:
      case SQLITE_NOTADB:
        fail("is damaged; move it away and run the study again, or merge the other shards");
      case SQLITE_BUSY:
      case SQLITE_LOCKED:
        fail("is locked by another process; wait for it or stop it");
      case SQLITE_INTERRUPT:
        throw Stopped(fmt::format("reading {}: interrupted", file_.string()));
      case SQLITE_FULL:
        fail("cannot be written: the disk is full; free space and continue with --resume");
      case SQLITE_READONLY:
      case SQLITE_CANTOPEN:
      case SQLITE_PERM:
        fail("cannot be opened or written; is the folder read-only?");
      default:
        fail(fmt::format("failed: {}", handle_ ? sqlite3_errmsg(handle_) : sqlite3_errstr(code)));
    }
  }
  [[noreturn]] void fail(const std::string& what) const { throw Error(fmt::format("{} {}", file_.string(), what)); }

 private:
  std::filesystem::path file_;
  sqlite3* handle_ = nullptr;
};

Statement::Statement(const Database& database, const std::string& sql) : database_(database) {
  database.check(sqlite3_prepare_v2(database.handle(), sql.c_str(), -1, &statement_, nullptr));
}

std::size_t Statement::whole(int i, std::size_t least, std::size_t end) const {
  const sqlite3_int64 value = sqlite3_column_int64(statement_, i);
  if (sqlite3_column_type(statement_, i) != SQLITE_INTEGER || value < 0 || std::size_t(value) < least ||
      std::size_t(value) >= end)
    database_.fail(
        fmt::format("is damaged: its trial {} is not one of the {} trials of the study, or is repeated; move "
                    "the file away and run the study again",
                    printable(text(i)), end));
  return std::size_t(value);
}

std::optional<double> Statement::number(int i) const {
  const int type = sqlite3_column_type(statement_, i);
  if (type == SQLITE_NULL) return {};
  const double value = sqlite3_column_double(statement_, i);
  if ((type != SQLITE_FLOAT && type != SQLITE_INTEGER) || !std::isfinite(value))
    database_.fail(
        fmt::format("is damaged: {} of trial {} is {}, not a finite number; move the file away and run the "
                    "study again",
                    sqlite3_column_name(statement_, i), printable(text(0)), printable(text(i))));
  return value;
}

bool Statement::step() {
  const int code = sqlite3_step(statement_);
  if (code != SQLITE_ROW) {
    sqlite3_reset(statement_);
    database_.check(code);
  }
  return code == SQLITE_ROW;
}

/// Lets an interrupt end queries during the lifetime of this object. Queries of an untrusted database may never end by
/// themselves, because of its views.
class Interruptible {
 public:
  explicit Interruptible(const Database& database) : handle_(database.handle()) {
    sqlite3_progress_handler(
        handle_, kInstructions, [](void*) { return int(interrupted()); }, nullptr);
  }
  ~Interruptible() { sqlite3_progress_handler(handle_, 0, nullptr, nullptr); }
  Interruptible(const Interruptible&) = delete;
  Interruptible& operator=(const Interruptible&) = delete;

 private:
  sqlite3* handle_;
};

std::string columns_sql(const std::string& each) {
  std::string sql;
  for (const TrialMetric& metric : trial_metrics()) sql += fmt::format(", {}{}", metric.name, each);
  return sql;
}

}  // namespace

struct StudyDatabase::Impl {
  Impl(const std::filesystem::path& folder, int flags, bool writes)
      : lock(writes ? writer_lock(folder) : nullptr), database(file_in(folder, file_name), flags) {}

  std::string value(const std::string& key) {
    const Interruptible reading(database);
    Statement select(database, "SELECT value FROM study WHERE key = ?");
    select.bind(1, key);
    if (!select.step()) database.fail(fmt::format("is not a study database: it has no {}", key));
    return select.text(0);
  }

  void prepare() {
    std::string values;
    for (std::size_t i = 0; i < trial_metrics().size(); ++i) values += ", ?";
    insert = std::make_unique<Statement>(
        database, fmt::format("INSERT OR IGNORE INTO trials (trial, status, message{}) VALUES (?, ?, ?{})",
                              columns_sql(""), values));
  }

  std::unique_ptr<FileLock> lock;
  Database database;
  Study study{};
  std::string yaml;
  std::unique_ptr<Statement> insert;  // last: destroyed before the database
};

StudyDatabase::StudyDatabase(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
StudyDatabase::StudyDatabase(StudyDatabase&&) noexcept = default;
StudyDatabase::~StudyDatabase() = default;

bool StudyDatabase::is_in(const std::filesystem::path& folder) { return std::filesystem::exists(folder / file_name); }

StudyDatabase StudyDatabase::create(const std::filesystem::path& folder, const Study& study, const std::string& yaml) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) throw Error(fmt::format("{} cannot be created: {}", folder.string(), error.message()));
  if (is_in(folder))
    throw Error(fmt::format("{} has a study already: continue with --resume or name another folder", folder.string()));
  auto impl = std::make_unique<Impl>(folder, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE, true);
  const Database& database = impl->database;
  database.run("PRAGMA synchronous = FULL");
  // SQLite keeps the pages of the deleted table in the file and reuses them for trials.
  database.run(
      fmt::format("BEGIN; CREATE TABLE room (bytes BLOB); INSERT INTO room VALUES (zeroblob({})); COMMIT;"
                  "DROP TABLE room",
                  study.trials() * kRowBytes));
  database.run(
      fmt::format("BEGIN; CREATE TABLE study (key TEXT PRIMARY KEY, value TEXT);"
                  "CREATE TABLE trials (trial INTEGER PRIMARY KEY, status TEXT, message TEXT{})",
                  columns_sql(" REAL")));
  for (const auto& [key, value] : {std::pair<std::string, std::string>{"format", kFormat},
                                   {"columns", columns_sql("")},
                                   {"canonical", study.canonical()},
                                   {"yaml", yaml}}) {
    Statement put(database, "INSERT INTO study VALUES (?, ?)");
    put.bind(1, key);
    put.bind(2, value);
    put.step();
  }
  database.run("COMMIT");
  impl->study = study;
  impl->yaml = yaml;
  impl->prepare();
  return StudyDatabase(std::move(impl));
}

StudyDatabase StudyDatabase::read(const std::filesystem::path& folder) {
  if (!is_in(folder)) throw Error(fmt::format("{} has no study: {} is missing", folder.string(), file_name));
  for (const char* suffix : {"", "-journal", "-wal", "-shm"})  // SQLite would wait for the writer of a pipe
    if (const auto file = file_in(folder, file_name + std::string(suffix)); std::filesystem::exists(file))
      close(detail::open_regular_file(file));
  auto impl = std::make_unique<Impl>(folder, SQLITE_OPEN_READWRITE,
                                     false);  // READWRITE rolls back the journal of a killed writer
  if (const std::string format = impl->value("format"); format != kFormat)
    impl->database.fail(fmt::format("has format {}, which this version of tandem cannot read", format));
  impl->yaml = impl->value("yaml");
  impl->study = parse_study(impl->yaml, folder / file_name);
  if (impl->value("columns") != columns_sql(""))
    impl->database.fail("has different columns than this version of tandem; continue with the version that created it");
  return StudyDatabase(std::move(impl));
}

StudyDatabase StudyDatabase::resume(const std::filesystem::path& folder, const Study& study) {
  StudyDatabase found = read(folder);
  Impl& impl = *found.impl_;
  if (impl.value("canonical") != study.canonical())
    throw Error(
        fmt::format("{} has trials of another study: its hash is {:016x}, this one's {:016x}; name another folder",
                    folder.string(), impl.study.hash(), study.hash()));
  impl.lock = writer_lock(folder);
  const Interruptible reading(impl.database);
  Statement check(impl.database, "PRAGMA quick_check");
  if (!check.step() || check.text(0) != "ok")
    impl.database.fail("is damaged; move it away and run the study again, or merge the other shards");
  impl.database.run("PRAGMA synchronous = FULL");
  impl.prepare();
  return found;
}

const Study& StudyDatabase::study() const { return impl_->study; }
const std::string& StudyDatabase::yaml() const { return impl_->yaml; }

void StudyDatabase::add(const TrialResult& result) {
  Statement& insert = *impl_->insert;
  insert.bind(1, result.trial);
  insert.bind(2, result.status);
  insert.bind(3, result.message);
  for (std::size_t i = 0; i < result.metrics.size(); ++i) insert.bind(static_cast<int>(i) + 4, result.metrics[i]);
  insert.step();
}

void StudyDatabase::add_all(const std::vector<TrialResult>& results) {
  impl_->database.run("BEGIN");
  for (const TrialResult& result : results) add(result);
  impl_->database.run("COMMIT");
}

std::size_t StudyDatabase::count() const {
  const Interruptible reading(impl_->database);
  Statement select(impl_->database, "SELECT COUNT(*) FROM trials");
  select.step();
  return select.whole(0, 0, impl_->study.trials() + 1);
}

std::vector<bool> StudyDatabase::finished() const {
  std::vector<bool> done(impl_->study.trials());
  const Interruptible reading(impl_->database);
  Statement select(impl_->database, "SELECT trial FROM trials");
  while (select.step()) done[select.whole(0, 0, done.size())] = true;
  return done;
}

std::vector<TrialResult> StudyDatabase::results() const {
  std::vector<TrialResult> results;
  const Interruptible reading(impl_->database);
  Statement select(impl_->database,
                   fmt::format("SELECT trial, status, message{} FROM trials ORDER BY trial", columns_sql("")));
  while (select.step()) {
    const std::size_t least = results.empty() ? 0 : results.back().trial + 1;
    TrialResult& result = results.emplace_back();
    result.trial = select.whole(0, least, impl_->study.trials());
    result.status = select.text(1);
    result.message = select.text(2);
    for (std::size_t i = 0; i < result.metrics.size(); ++i) result.metrics[i] = select.number(static_cast<int>(i) + 3);
  }
  return results;
}

}  // namespace tandem
