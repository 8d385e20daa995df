#pragma once

#include <sqlite3.h>

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "modules/recordings/bag_reader.hpp"

namespace km {

/// Reads the .db3 files of rosbag2: SQLite databases with tables topics and messages. The reader
/// does not write to the file and runs no views and triggers of the database. It also reads
/// messages that the recorder left in a write-ahead log beside the file. Faults name the message by
/// its id in the table.
class Db3Reader final : public BagReader {
 public:
  /// Throws InputFileError if `path` is no file, no database, or lacks one of the two tables.
  explicit Db3Reader(const std::filesystem::path& path);

  [[nodiscard]] const std::vector<BagChannel>& channels() const override { return channels_; }
  [[nodiscard]] std::optional<BagMessage> next() override;
  [[nodiscard]] BagReport report() const override { return report_; }

 private:
  struct Close {
    void operator()(sqlite3* database) const { sqlite3_close(database); }
    void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
  };
  using Statement = std::unique_ptr<sqlite3_stmt, Close>;

  void open();
  void check_tables();
  [[nodiscard]] Statement prepare(const char* sql) const;
  void read_topics();
  void count_messages();
  // Steps to the next row; true if there is one. Rows end at an error, or after max_rows_ rows.
  [[nodiscard]] bool step(sqlite3_stmt* rows, std::uint64_t& count);
  [[nodiscard]] std::optional<BagMessage> message_in_row();
  [[nodiscard]] std::optional<std::vector<std::uint8_t>> data_of(std::int64_t id);
  void add_fault(BagFault fault, const std::string& why);
  [[noreturn]] void refuse(const std::string& why) const;

  std::filesystem::path path_;
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

}  // namespace km
