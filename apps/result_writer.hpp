#pragma once

#include <exception>
#include <filesystem>
#include <map>
#include <mutex>
#include <string>

#include "runtime/log.hpp"

namespace km {

/// Writes results independently of each other. The reason why a result could not be written is
/// logged (at a limited rate) and kept, and the others are written all the same. Thread-safe.
class ResultWriter {
 public:
  /// Calls `writer(file)`, which throws if the file cannot be written. A file that failed before
  /// and is written now is no longer lost.
  void write(const std::filesystem::path& file, const auto& writer) try {
    writer(file);
    const std::lock_guard lock(mutex_);
    lost_.erase(file.string());
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
  mutable std::mutex mutex_;  // guards lost_
  std::map<std::string, std::string> lost_;
};

}  // namespace km
