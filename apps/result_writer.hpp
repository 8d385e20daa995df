#pragma once

#include <exception>
#include <filesystem>
#include <map>
#include <mutex>
#include <string>

#include "runtime/log.hpp"

namespace km {

/// Writes results, each on its own: what keeps one from being written is logged (at a limited rate)
/// and kept, and all others are written as if nothing were. Thread-safe.
class ResultWriter {
 public:
  /// Calls `writer(file)`, which throws what keeps the file from being written. One that could not
  /// be written before and now can is lost no more.
  void write(const std::filesystem::path& file, const auto& writer) try {
    writer(file);
    const std::lock_guard lock(mutex_);
    lost_.erase(file.string());
  } catch (const std::exception& error) {
    note(file, error.what());
  }

  /// Notes that `file` is lost, and why. The reason may name the file or leave it to this.
  void note(const std::filesystem::path& file, std::string why) {
    if (why.find(file.string()) == std::string::npos) why = file.string() + ": " + why;
    log::limited(log::Level::kError, "results", file.string()) << why;
    const std::lock_guard lock(mutex_);
    lost_[file.string()] = std::move(why);
  }

  /// Why each file that is lost is, ascending by name: "out/mesh.ply: cannot be written: No space
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
