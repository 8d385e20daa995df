#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "apps/lab/simulation/dataset/dataset_record.hpp"

namespace km {

/// The output folder of a run: new, or begun by a run with the same parameters. Only one run at a
/// time can use it.
class DatasetFolder {
 public:
  /// Makes the folder if it is missing. Throws std::runtime_error with a remedy in these cases: the
  /// folder has other content, was made with other parameters, is in use by another run, or cannot
  /// be written to.
  DatasetFolder(const std::filesystem::path& path, const DatasetRecord& wanted);
  ~DatasetFolder();
  DatasetFolder(const DatasetFolder&) = delete;
  DatasetFolder& operator=(const DatasetFolder&) = delete;

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  [[nodiscard]] bool is_complete() const { return record_.complete; }
  [[nodiscard]] bool is_resumed() const { return resumed_; }

  void mark_finished(const std::string& robot);
  void mark_complete();
  /// Marks the folder as incomplete.
  void mark_incomplete();

  /// Free space on the disk [bytes].
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
