// SPDX-License-Identifier: Apache-2.0
#include "calib/plan/run_log.h"

#include <fmt/format.h>
#include <sqlite3.h>

#include <array>
#include <cmath>
#include <functional>
#include <limits>

namespace toftwin::plan {
namespace {

constexpr int kVersion = 3;
constexpr std::int64_t kApplicationId = 0x746F6674;  ///< "toft": what says that a database is such a log
/// What brings a log from one version to the next; the first makes it.
constexpr std::array kMigrations{
    "CREATE TABLE run (id INTEGER PRIMARY KEY, judged TEXT NOT NULL, began TEXT NOT NULL, folder TEXT NOT "
    "NULL,"
    " plan TEXT NOT NULL, camera_a TEXT NOT NULL, camera_b TEXT NOT NULL, software TEXT NOT NULL, note TEXT "
    "NOT NULL,"
    " index_sha256 TEXT NOT NULL, locked INTEGER NOT NULL, UNIQUE (index_sha256, locked));"
    "CREATE TABLE characteristic (run INTEGER NOT NULL REFERENCES run (id) ON DELETE CASCADE, of TEXT NOT "
    "NULL,"
    " what TEXT NOT NULL, detail TEXT NOT NULL, name TEXT NOT NULL, unit TEXT NOT NULL, value REAL, low REAL,"
    " high REAL, n INTEGER NOT NULL,"
    " PRIMARY KEY (run, of, what, name));"
    "CREATE TABLE untold (run INTEGER NOT NULL REFERENCES run (id) ON DELETE CASCADE, why TEXT NOT NULL);",
    "CREATE TABLE camera (name TEXT PRIMARY KEY, source TEXT NOT NULL, model TEXT NOT NULL, serial TEXT NOT "
    "NULL);"
    "CREATE TABLE setting (run INTEGER NOT NULL REFERENCES run (id) ON DELETE CASCADE, of TEXT NOT NULL,"
    " name TEXT NOT NULL, value TEXT NOT NULL, PRIMARY KEY (run, of, name));",
    "ALTER TABLE run ADD COLUMN frames_b INTEGER; ALTER TABLE run ADD COLUMN same_frames INTEGER;"};
static_assert(kMigrations.size() == kVersion);

Error failure(sqlite3* database, const std::string& what) {
  return {Error::Code::Malformed, fmt::format("the log: {}: {}", what, sqlite3_errmsg(database))};
}

Result<> execute(sqlite3* database, const char* sql) {
  return sqlite3_exec(database, sql, nullptr, nullptr, nullptr) == SQLITE_OK ? Result<>{}
                                                                             : failure(database, "SQL");
}

/// One prepared statement: values are bound one after the other, columns read one after the other.
class Statement {
 public:
  Statement(sqlite3* database, const std::string& sql) : database_(database) {
    sqlite3_prepare_v2(database, sql.c_str(), -1, &statement_, nullptr);
  }
  ~Statement() { sqlite3_finalize(statement_); }
  Statement(const Statement&) = delete;
  Statement& operator=(const Statement&) = delete;

  Statement& bind(const std::string& text) {
    sqlite3_bind_text(statement_, ++bound_, text.c_str(), static_cast<int>(text.size()), SQLITE_TRANSIENT);
    return *this;
  }
  Statement& bind(std::int64_t number) {
    sqlite3_bind_int64(statement_, ++bound_, number);
    return *this;
  }
  /// What is below 0 is not known: NULL.
  Statement& bindCount(std::int64_t number) {
    ++bound_;
    if (number >= 0) sqlite3_bind_int64(statement_, bound_, number);
    return *this;
  }
  /// What is not finite is NULL.
  Statement& bindReal(double number) {
    ++bound_;
    if (std::isfinite(number)) sqlite3_bind_double(statement_, bound_, number);
    return *this;
  }
  Result<> each(const std::function<void(Statement&)>& row) {
    if (statement_ == nullptr) return failure(database_, "a statement");
    int state = SQLITE_ROW;
    while ((state = sqlite3_step(statement_)) == SQLITE_ROW) {
      column_ = 0;
      row(*this);
    }
    return state == SQLITE_DONE ? Result<>{} : failure(database_, "a statement");
  }
  Result<> run() {
    return each([](Statement&) {});
  }
  std::string text() {
    const auto* value = sqlite3_column_text(statement_, column_++);
    return value == nullptr ? std::string{} : std::string{reinterpret_cast<const char*>(value)};
  }
  std::int64_t number() { return sqlite3_column_int64(statement_, column_++); }
  /// -1: NULL, not known.
  std::int64_t count() {
    const int at = column_++;
    return sqlite3_column_type(statement_, at) == SQLITE_NULL ? -1 : sqlite3_column_int64(statement_, at);
  }
  double real() {
    const int at = column_++;
    return sqlite3_column_type(statement_, at) == SQLITE_NULL ? std::numeric_limits<double>::quiet_NaN()
                                                              : sqlite3_column_double(statement_, at);
  }

 private:
  sqlite3* database_;
  sqlite3_stmt* statement_ = nullptr;
  int bound_ = 0, column_ = 0;
};

constexpr const char* kRunColumns =
    "run.id, judged, began, folder, plan, camera_a, camera_b, software, note, index_sha256, locked, "
    "frames_b, same_frames, (SELECT s.value FROM setting s WHERE s.run = run.id AND s.of = '' AND s.name = 'captures'), "
    "(SELECT s.value FROM setting s WHERE s.run = run.id AND s.of = '' AND s.name = 'captures_planned')";

LoggedRun runFrom(Statement& row) {
  LoggedRun run;
  run.id = row.number(), run.judged = row.text(), run.began = row.text(), run.folder = row.text();
  run.plan = row.text(), run.camera_a = row.text(), run.camera_b = row.text(), run.software = row.text();
  run.note = row.text(), run.index_sha256 = row.text(), run.is_locked = row.number() != 0;
  run.frames_of_b = row.count(), run.same_frames = row.count();
  run.captures = row.number(), run.planned = row.number();
  return run;
}

/// A camera is called the same in `run`.
Result<> writeCamera(sqlite3* database, const std::string& text) {
  const CameraName name = cameraNameOf(text);
  Statement row{database, "INSERT OR IGNORE INTO camera VALUES (?, ?, ?, ?)"};
  return row.bind(text).bind(name.source).bind(name.model).bind(name.serial).run();
}

Result<> writeSettings(sqlite3* database, std::int64_t id, const LoggedRun& run) {
  for (const std::string* camera : {&run.camera_a, &run.camera_b}) {
    if (auto done = writeCamera(database, *camera); !done) return done;
  }
  for (const RunSetting& one : run.settings) {
    Statement row{database, "INSERT OR REPLACE INTO setting VALUES (?, ?, ?, ?)"};
    if (auto done = row.bind(id).bind(one.of).bind(one.name).bind(one.value).run(); !done) return done;
  }
  return {};
}

Result<> write(sqlite3* database, const LoggedRun& run, const RunTraits& traits) {
  // The same captures, or those of a run that has gone on since.
  Statement remove{database,
                   "DELETE FROM run WHERE locked = ? AND (index_sha256 = ? OR (began = ? AND folder = ? AND plan = ? "
                   "AND camera_a = ? AND camera_b = ?))"};
  remove.bind(std::int64_t{run.is_locked}).bind(run.index_sha256).bind(run.began).bind(run.folder).bind(run.plan);
  if (auto done = remove.bind(run.camera_a).bind(run.camera_b).run(); !done) return done;
  Statement insert{
      database,
      "INSERT INTO run (judged, began, folder, plan, camera_a, camera_b, software, note, index_sha256, "
      "locked, frames_b, same_frames) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)"};
  for (const std::string* text : {&run.judged, &run.began, &run.folder, &run.plan, &run.camera_a,
                                  &run.camera_b, &run.software, &run.note, &run.index_sha256})
    insert.bind(*text);
  insert.bind(std::int64_t{run.is_locked}).bindCount(run.frames_of_b).bindCount(run.same_frames);
  if (auto done = insert.run(); !done) return done;
  const std::int64_t id = sqlite3_last_insert_rowid(database);
  if (auto done = writeSettings(database, id, run); !done) return done;
  for (const compare::NamedTrait& one : traits.traits) {
    const compare::Trait& trait = one.trait;
    Statement row{database, "INSERT OR REPLACE INTO characteristic VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?)"};
    row.bind(id).bind(one.of).bind(one.what).bind(detailsOf(one)).bind(trait.name).bind(trait.unit);
    row.bindReal(trait.value).bindReal(trait.low).bindReal(trait.high);
    if (auto done = row.bind(static_cast<std::int64_t>(trait.n)).run(); !done) return done;
  }
  for (const std::string& why : traits.untold) {
    Statement row{database, "INSERT INTO untold VALUES (?, ?)"};
    if (auto done = row.bind(id).bind(why).run(); !done) return done;
  }
  return {};
}

Result<std::int64_t> numberOf(sqlite3* database, const std::string& question) {
  std::int64_t number = 0;
  Statement asked{database, question};
  if (auto done = asked.each([&](Statement& row) { number = row.number(); }); !done) return done.error();
  return number;
}

/// The log's version: 0 of an empty database. Why it is no log of ours, as an Error.
Result<std::int64_t> versionOf(sqlite3* database) {
  const auto id = numberOf(database, "PRAGMA application_id");
  if (!id) {
    return Error{Error::Code::InvalidArgument,
                 fmt::format("is no SQLite database that can be read: {}", sqlite3_errmsg(database))};
  }
  const auto version = numberOf(database, "PRAGMA user_version");
  if (!version) return version.error();
  const auto tables = numberOf(database, "SELECT count(*) FROM sqlite_master");
  if (!tables) return tables.error();
  const bool is_empty = *id == 0 && *version == 0 && *tables == 0;
  if (*id != kApplicationId && !is_empty)
    return Error{Error::Code::InvalidArgument, "is a database of something else"};
  if (*version > kVersion) {
    return Error{Error::Code::InvalidArgument,
                 fmt::format("is of version {}, which a newer toftwin made; this one knows {}", *version, kVersion)};
  }
  if (*version < 0 || (*version == 0 && !is_empty)) {
    return Error{Error::Code::InvalidArgument,
                 fmt::format("is of version {}, which no toftwin makes: the file is damaged", *version)};
  }
  return version;
}

/// The cameras of runs that a log of version 1 has.
Result<> fillCameras(sqlite3* database) {
  std::vector<std::string> names;
  Statement asked{database, "SELECT camera_a FROM run UNION SELECT camera_b FROM run"};
  if (auto done = asked.each([&](Statement& row) { names.push_back(row.text()); }); !done) return done;
  for (const std::string& name : names) {
    if (auto done = writeCamera(database, name); !done) return done;
  }
  return {};
}

/// Brings it to this version; to be called within a transaction that nobody else can write in.
Result<> migrate(sqlite3* database) {
  const auto version = versionOf(database);
  if (!version) return version.error();
  for (std::int64_t from = *version; from < kVersion; ++from) {
    const std::string sql = fmt::format("{} PRAGMA application_id = {}; PRAGMA user_version = {};",
                                        kMigrations[static_cast<std::size_t>(from)], kApplicationId, from + 1);
    if (auto done = execute(database, sql.c_str()); !done) return done;
    if (from == 1) {
      if (auto done = fillCameras(database); !done) return done;
    }
  }
  return {};
}

/// Does it all, or nothing of it.
Result<> within(sqlite3* database, const char* begin, const std::function<Result<>()>& work) {
  if (auto begun = execute(database, begin); !begun) return begun;
  auto done = work();
  if (done) done = execute(database, "COMMIT");
  if (!done) static_cast<void>(execute(database, "ROLLBACK"));
  return done;
}

}  // namespace

Result<RunLog> RunLog::open(const std::filesystem::path& file) {
  sqlite3* raw = nullptr;
  const int opened = sqlite3_open(file.c_str(), &raw);
  RunLog log{std::shared_ptr<sqlite3>{raw, [](sqlite3* one) { sqlite3_close(one); }}};
  const auto refuse = [&](const std::string& why) {
    return Error{Error::Code::InvalidArgument, fmt::format("{}: {}", file.string(), why)};
  };
  if (opened != SQLITE_OK) return refuse(fmt::format("cannot be opened as a log: {}", sqlite3_errmsg(raw)));
  sqlite3_busy_timeout(raw, 5000);
  // A log of this version is only read here, so that one which may not be written can be looked at.
  std::int64_t version = 0;
  const auto looked = within(raw, "BEGIN", [&]() -> Result<> {
    const auto there = versionOf(raw);
    if (!there) return there.error();
    version = *there;
    return {};
  });
  if (!looked) return refuse(looked.error().message);
  if (version < kVersion) {
    if (auto done = within(raw, "BEGIN IMMEDIATE", [&] { return migrate(raw); }); !done)
      return refuse(done.error().message);
  }
  if (auto done = execute(raw, "PRAGMA foreign_keys = ON"); !done) return done.error();
  return log;
}

Result<> RunLog::checkWritable() {
  return within(database_.get(), "BEGIN IMMEDIATE", [] { return Result<>{}; });
}

Result<> RunLog::add(const LoggedRun& run, const RunTraits& traits) {
  return within(database_.get(), "BEGIN IMMEDIATE", [&] { return write(database_.get(), run, traits); });
}

Result<std::vector<LoggedRun>> RunLog::runs() {
  std::vector<LoggedRun> all;
  Statement asked{database_.get(), fmt::format("SELECT {} FROM run ORDER BY began, id", kRunColumns)};
  if (auto done = asked.each([&](Statement& row) { all.push_back(runFrom(row)); }); !done)
    return done.error();
  return all;
}

Result<std::vector<CameraName>> RunLog::cameras() {
  std::vector<CameraName> all;
  Statement asked{database_.get(), "SELECT source, model, serial FROM camera ORDER BY name"};
  const auto done = asked.each([&](Statement& row) {
    CameraName& one = all.emplace_back();
    one.source = row.text(), one.model = row.text(), one.serial = row.text();
  });
  if (!done) return done.error();
  return all;
}

Result<std::vector<RunSetting>> RunLog::settings(std::int64_t run) {
  std::vector<RunSetting> all;
  Statement asked{database_.get(), "SELECT of, name, value FROM setting WHERE run = ? ORDER BY rowid"};
  const auto done = asked.bind(run).each([&](Statement& row) {
    RunSetting& one = all.emplace_back();
    one.of = row.text(), one.name = row.text(), one.value = row.text();
  });
  if (!done) return done.error();
  return all;
}

Result<std::vector<LoggedTrait>> RunLog::traits(const std::string& camera, const std::string& what,
                                                const std::string& name) {
  std::vector<LoggedTrait> all;
  Statement asked{
      database_.get(),
      fmt::format("SELECT {}, of, what, detail, name, unit, value, low, high, n FROM characteristic JOIN run ON "
                  "run = run.id WHERE substr(what, 1, length(?1)) = ?1 AND substr(name, 1, length(?2)) = "
                  "?2 ORDER BY what, name, of, began, run.id",
                  kRunColumns)};
  asked.bind(what).bind(name);
  const auto done = asked.each([&](Statement& row) {
    LoggedTrait one{.run = runFrom(row), .trait = {}};
    one.trait.of = row.text(), one.trait.what = row.text(), one.trait.detail = row.text();
    auto& trait = one.trait.trait;
    trait.name = row.text(), trait.unit = row.text();
    trait.value = row.real(), trait.low = row.real(), trait.high = row.real();
    trait.n = static_cast<std::size_t>(row.number());
    if (one.isOf(camera)) all.push_back(std::move(one));
  });
  if (!done) return done.error();
  return all;
}

}  // namespace toftwin::plan
