// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <sqlite3.h>

#include <map>

#include "tools/cli/import/bag/bag.h"

namespace toftwin::cli {
namespace {

struct Close {
  void operator()(sqlite3* database) const { sqlite3_close(database); }
  void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
};
using Database = std::unique_ptr<sqlite3, Close>;
using Statement = std::unique_ptr<sqlite3_stmt, Close>;

Error malformed(const std::filesystem::path& file, std::string_view what) {
  return {Error::Code::Malformed, fmt::format("{}: {}", file.string(), what)};
}

Result<Statement> prepare(const Database& database, const std::filesystem::path& file, const char* query) {
  sqlite3_stmt* made = nullptr;
  const int code = sqlite3_prepare_v2(database.get(), query, -1, &made, nullptr);
  Statement statement{made};
  if (code != SQLITE_OK) return malformed(file, fmt::format("this is no bag of ROS 2: {}", sqlite3_errmsg(database.get())));
  return statement;
}

std::string textAt(const Statement& row, int column) {
  const auto* text = reinterpret_cast<const char*>(sqlite3_column_text(row.get(), column));
  return text != nullptr ? std::string{text, static_cast<std::size_t>(sqlite3_column_bytes(row.get(), column))} : std::string{};
}

class Db3Bag final : public Bag {
 public:
  Db3Bag(Database database, std::filesystem::path file) : file_(std::move(file)), database_(std::move(database)) {}

  Result<> open() {
    auto topics = prepare(database_, file_, "SELECT id, name, type, serialization_format FROM topics");
    if (!topics) return topics.error();
    while (sqlite3_step(topics->get()) == SQLITE_ROW) {
      of_id_[sqlite3_column_int64(topics->get(), 0)] = topics_.size();
      topics_.push_back({textAt(*topics, 1), plainType(textAt(*topics, 2)), textAt(*topics, 3) == "cdr" ? Dialect::Cdr : Dialect::Other});
    }
    auto rows = prepare(database_, file_, "SELECT topic_id, timestamp, data FROM messages ORDER BY timestamp");
    if (!rows) return rows.error();
    rows_ = *std::move(rows);
    return {};
  }
  [[nodiscard]] const std::vector<BagTopic>& topics() const override { return topics_; }
  Result<BagMessage> next() override {
    while (true) {
      const int code = is_done_ ? SQLITE_DONE : sqlite3_step(rows_.get());
      if (code != SQLITE_ROW) {
        const bool was_done = is_done_;
        is_done_ = true;
        if (code != SQLITE_DONE && !was_done) return malformed(file_, fmt::format("it cannot be read further: {}", sqlite3_errmsg(database_.get())));
        return Error{Error::Code::EndOfStream, "no more messages"};
      }
      const auto topic = of_id_.find(sqlite3_column_int64(rows_.get(), 0));
      if (topic == of_id_.end()) continue;
      const auto* data = static_cast<const std::byte*>(sqlite3_column_blob(rows_.get(), 2));
      const auto size = static_cast<std::size_t>(sqlite3_column_bytes(rows_.get(), 2));
      return BagMessage{topic->second, sqlite3_column_int64(rows_.get(), 1), {data, data != nullptr ? size : 0}};
    }
  }

 private:
  std::filesystem::path file_;
  Database database_;  // outlives its statements
  Statement rows_;
  std::vector<BagTopic> topics_;
  std::map<std::int64_t, std::size_t> of_id_;
  bool is_done_ = false;
};

}  // namespace

Result<std::unique_ptr<Bag>> openDb3Bag(const std::filesystem::path& file) {
  sqlite3* opened = nullptr;
  const int code = sqlite3_open_v2(file.c_str(), &opened, SQLITE_OPEN_READONLY | SQLITE_OPEN_NOMUTEX, nullptr);
  Database database{opened};
  if (code != SQLITE_OK) return malformed(file, opened != nullptr ? sqlite3_errmsg(opened) : "it cannot be opened");
  // A file that somebody made to be read here runs nothing of its own, and no value of it takes all memory.
  constexpr int kMostBytes = 256 << 20, kMostSteps = 1'000'000'000;
  sqlite3_limit(opened, SQLITE_LIMIT_LENGTH, kMostBytes);
  sqlite3_db_config(opened, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
  sqlite3_db_config(opened, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
  sqlite3_db_config(opened, SQLITE_DBCONFIG_ENABLE_VIEW, 0, nullptr);
  sqlite3_db_config(opened, SQLITE_DBCONFIG_ENABLE_TRIGGER, 0, nullptr);
  sqlite3_exec(opened, "PRAGMA cell_size_check = ON; PRAGMA mmap_size = 0; PRAGMA temp_store = FILE", nullptr, nullptr, nullptr);
  sqlite3_progress_handler(opened, kMostSteps, [](void*) { return 1; }, nullptr);
  auto bag = std::make_unique<Db3Bag>(std::move(database), file);
  if (auto ready = bag->open(); !ready) return ready.error();
  return std::unique_ptr<Bag>{std::move(bag)};
}

}  // namespace toftwin::cli
