#pragma once

#include <exception>
#include <filesystem>
#include <map>
#include <mutex>
#include <string>
#include <utility>

#include "runtime/log.hpp"

namespace km {

/// Writes results independently of each other. The reason why a result could not be written is
/// logged (at a limited rate) and kept, and the others are written all the same. Thread-safe.
class ResultWriter {
 public:
  /// Calls `writer(file)`, which throws if the file cannot be written. If the folder of the file is
  /// gone, it is made again. A file that failed before and is written now is no longer lost.
  void write(const std::filesystem::path& file, const auto& writer) {
    append(file, [&](const auto&) {
      if (file.has_parent_path()) std::filesystem::create_directories(file.parent_path());
      writer(file);
    });
  }

  /// Like write(), for a file that grows in its folder: the folder is not made again.
  void append(const std::filesystem::path& file, const auto& writer) try {
    writer(file);
    keep(file);
  } catch (const std::exception& error) {
    note(file, error.what());
  }

  /// Notes that `file` is lost, with the reason. The reason may include the name of the file.
  void note(const std::filesystem::path& file, std::string why) {
    if (why.find(file.string()) == std::string::npos) why = file.string() + ": " + why;
    log::limited(log::Level::kError, "results", file.string()) << why;
    const std::lock_guard lock(mutex_);
    lost_[file.string()] = std::move(why);
  }

  /// The reason for each lost file, ascending by name: "out/mesh.ply: cannot be written: No space
  /// left on device".
  [[nodiscard]] std::map<std::string, std::string> lost() const {
    const std::lock_guard lock(mutex_);
    return lost_;
  }

 private:
  void keep(const std::filesystem::path& file) {
    const std::lock_guard lock(mutex_);
    lost_.erase(file.string());
  }

  mutable std::mutex mutex_;  // guards lost_
  std::map<std::string, std::string> lost_;
};

}  // namespace km
