#include <sqlite3.h>

#include <cctype>
#include <map>
#include <memory>
#include <string_view>
#include <utility>

#include "modules/core/io/input_file.hpp"
#include "modules/recordings/chunked_file.hpp"
#include "modules/recordings/open_bag.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

bool is_in_use(const fs::path& path, const char* suffix) {
  std::error_code none;
  const auto size = fs::file_size(path.string() + suffix, none);
  return !none && size > 0;
}

// URI of `path` with options for SQLite. If there is no log or journal beside the file, it is
// complete. With "immutable", SQLite then needs no lock and writes no other file.
std::string uri_of(const fs::path& path) {
  std::string uri = "file:";
  for (const char c : fs::absolute(path).string()) {
    constexpr const char* kHex = "0123456789ABCDEF";
    const auto byte = static_cast<unsigned char>(c);
    if (std::isalnum(byte) != 0 || c == '/' || c == '.' || c == '_' || c == '-')
      uri += c;
    else
      uri += {'%', kHex[byte >> 4U], kHex[byte & 15U]};
  }
  const bool is_complete = !is_in_use(path, "-wal") && !is_in_use(path, "-journal");
  return uri + (is_complete ? "?immutable=1" : "");
}

std::string text_in(sqlite3_stmt* row, int column) {
  const unsigned char* const text = sqlite3_column_text(row, column);
  const auto size = static_cast<std::size_t>(sqlite3_column_bytes(row, column));
  return text == nullptr ? std::string() : std::string(reinterpret_cast<const char*>(text), size);
}

class Db3Reader final : public BagReader {
 public:
  explicit Db3Reader(const fs::path& path) : path_(path) {
    constexpr std::string_view kMagic{"SQLite format 3\0", 16};
    constexpr std::uint64_t kLeastRow_bytes = 4;
    const RandomAccessFile file(path);
    if (file.beginning(kMagic.size()) != kMagic) refuse("not a SQLite database");
    max_rows_ = file.size() / kLeastRow_bytes;
    if (is_in_use(path, "-wal"))
      max_rows_ += fs::file_size(path.string() + "-wal") / kLeastRow_bytes;
    open();
    read_topics();
    rows_ = prepare("SELECT id, topic_id, timestamp FROM messages ORDER BY timestamp, id");
    data_ = prepare("SELECT data FROM messages WHERE id = ?1");
  }

  [[nodiscard]] const std::vector<BagChannel>& channels() const override { return channels_; }

  [[nodiscard]] std::optional<BagMessage> next() override {
    while (!is_done_) {
      is_done_ = !step(rows_.get(), row_count_);
      if (is_done_) break;
      if (auto message = message_in_row()) return message;
    }
    return std::nullopt;
  }

  [[nodiscard]] BagReport report() const override { return report_; }

 private:
  struct Close {
    void operator()(sqlite3* database) const { sqlite3_close(database); }
    void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
  };
  using Statement = std::unique_ptr<sqlite3_stmt, Close>;

  void open() {
    sqlite3* opened = nullptr;
    const int result =
        sqlite3_open_v2(uri_of(path_).c_str(), &opened,
                        SQLITE_OPEN_READONLY | SQLITE_OPEN_URI | SQLITE_OPEN_NOMUTEX, nullptr);
    database_.reset(opened);
    if (result != SQLITE_OK) refuse(sqlite3_errstr(result));
    sqlite3_limit(opened, SQLITE_LIMIT_LENGTH, static_cast<int>(kMaxDecompressed_bytes));
    sqlite3_db_config(opened, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
    sqlite3_db_config(opened, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
    sqlite3_db_config(opened, SQLITE_DBCONFIG_ENABLE_VIEW, 0, nullptr);
    // Accepts only tables, because SQLite would execute the text of a view.
    for (const std::string name : {"topics", "messages"}) {
      const Statement found = prepare(
          ("SELECT 1 FROM sqlite_master WHERE type = 'table' AND name = '" + name + "'").c_str());
      if (sqlite3_step(found.get()) != SQLITE_ROW)
        refuse("no table " + name + ", as rosbag2 has it");
    }
  }

  [[nodiscard]] Statement prepare(const char* sql) const {
    sqlite3_stmt* prepared = nullptr;
    const int result = sqlite3_prepare_v2(database_.get(), sql, -1, &prepared, nullptr);
    Statement statement(prepared);
    if (result != SQLITE_OK || statement == nullptr) refuse(sqlite3_errmsg(database_.get()));
    return statement;
  }

  void read_topics() {
    const Statement topics =
        prepare("SELECT id, name, type, serialization_format FROM topics ORDER BY id");
    for (std::uint64_t count = 0; step(topics.get(), count);) {
      const std::int64_t id = sqlite3_column_int64(topics.get(), 0);
      if (!channel_of_.try_emplace(id, channels_.size()).second) continue;
      channels_.push_back({.topic = text_in(topics.get(), 1),
                           .type = text_in(topics.get(), 2),
                           .encoding = text_in(topics.get(), 3)});
    }
    const Statement messages = prepare("SELECT topic_id FROM messages");
    for (std::uint64_t count = 0; step(messages.get(), count);) {
      const auto channel = channel_of_.find(sqlite3_column_int64(messages.get(), 0));
      if (channel != channel_of_.end()) ++channels_[channel->second].message_count;
    }
  }

  // Steps to the next row; true if there is one. Rows end at an error, or after max_rows_ rows,
  // because cyclic pages would yield rows without end.
  [[nodiscard]] bool step(sqlite3_stmt* rows, std::uint64_t& count) {
    const int result = sqlite3_step(rows);
    if (result == SQLITE_DONE) return false;
    if (result == SQLITE_ROW && count++ < max_rows_) return true;
    add_fault(BagFault::kMalformed, result == SQLITE_ROW ? "more rows than the file can hold"
                                                         : sqlite3_errmsg(database_.get()));
    return false;
  }

  // The message in the current row; nullopt if it is unusable.
  [[nodiscard]] std::optional<BagMessage> message_in_row() {
    const std::int64_t id = sqlite3_column_int64(rows_.get(), 0);
    const auto lose = [&](BagFault fault, const std::string& why) {
      add_fault(fault, "message " + std::to_string(id) + ": " + why);
      return std::nullopt;
    };
    const std::int64_t topic = sqlite3_column_int64(rows_.get(), 1);
    const auto channel = channel_of_.find(topic);
    if (channel == channel_of_.end())
      return lose(BagFault::kUnknownChannel, "topic " + std::to_string(topic));
    const std::string& name = channels_[channel->second].topic;
    const bool is_number = sqlite3_column_type(rows_.get(), 2) == SQLITE_INTEGER;
    const Stamp log_time = sqlite3_column_int64(rows_.get(), 2);
    if (!is_number || log_time < 0)
      return lose(BagFault::kMalformed, name + ": a time that is no number from 0 on");
    if (last_ && log_time < *last_) return lose(BagFault::kUnordered, name);
    auto data = data_of(id);
    if (!data) return lose(BagFault::kMalformed, name + ": its data cannot be read");
    last_ = log_time;
    return BagMessage{.channel = channel->second, .log_time = log_time, .bytes = *std::move(data)};
  }

  [[nodiscard]] std::optional<std::vector<std::uint8_t>> data_of(std::int64_t id) {
    sqlite3_reset(data_.get());
    sqlite3_bind_int64(data_.get(), 1, id);
    if (sqlite3_step(data_.get()) != SQLITE_ROW) return std::nullopt;
    if (sqlite3_column_type(data_.get(), 0) != SQLITE_BLOB) return std::nullopt;
    const auto* const bytes = static_cast<const std::uint8_t*>(sqlite3_column_blob(data_.get(), 0));
    const int size = sqlite3_column_bytes(data_.get(), 0);
    if (bytes == nullptr && size > 0) return std::nullopt;
    return std::vector<std::uint8_t>(bytes, bytes + size);
  }

  void add_fault(BagFault fault, const std::string& why) {
    report_.add(fault, path_.string() + ": " + why);
  }
  [[noreturn]] void refuse(const std::string& why) const {
    throw InputFileError(path_.string() + ": " + why);
  }

  const fs::path path_;
  std::uint64_t max_rows_ = 0;
  BagReport report_;
  std::unique_ptr<sqlite3, Close> database_;  // outlives its statements
  Statement rows_;                            // iterates over the messages in order of time
  Statement data_;                            // reads the data of one message
  std::map<std::int64_t, std::size_t> channel_of_;
  std::vector<BagChannel> channels_;
  std::uint64_t row_count_ = 0;
  std::optional<Stamp> last_;
  bool is_done_ = false;
};

}  // namespace

std::unique_ptr<BagReader> open_db3(const fs::path& path) {
  return std::make_unique<Db3Reader>(path);
}

}  // namespace km
