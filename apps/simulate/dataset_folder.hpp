#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "modules/simulation/dataset/dataset_record.hpp"

namespace km {

/// The folder a run writes to: new, or one that a run with the same parameters began. No other run
/// can have it at the same time.
class DatasetFolder {
 public:
  /// Makes the folder where it is missing. Throws std::runtime_error that says what to do for one
  /// with other things in it, one made with other parameters, one another run writes to, and one
  /// that cannot be written.
  DatasetFolder(const std::filesystem::path& path, const DatasetRecord& wanted);
  ~DatasetFolder();
  DatasetFolder(const DatasetFolder&) = delete;
  DatasetFolder& operator=(const DatasetFolder&) = delete;

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  [[nodiscard]] bool is_complete() const { return record_.complete; }
  [[nodiscard]] bool is_resumed() const { return resumed_; }

  void mark_finished(const std::string& robot);
  void mark_complete();
  /// It turned out not to be complete.
  void mark_incomplete();

  /// Room on the disk [bytes].
  [[nodiscard]] std::uintmax_t free_space() const;

 private:
  void lock();
  void open_record(const DatasetRecord& wanted);
  void write_record() const;

  std::filesystem::path path_;
  DatasetRecord record_;
  bool resumed_ = false;
  int lock_ = -1;
};

}  // namespace km
