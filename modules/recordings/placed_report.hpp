#pragma once

#include <cstdint>
#include <set>
#include <string>

#include "modules/recordings/bag_reader.hpp"
#include "modules/recordings/random_access_file.hpp"

namespace km {

/// Faults in a file with their byte positions. Faults of a chunk that is read again are not counted
/// again.
class PlacedReport {
 public:
  /// `file` must outlive the report.
  explicit PlacedReport(const RandomAccessFile& file) : file_(file) {}

  void add(BagFault fault, std::uint64_t offset, const std::string& why) {
    if (!is_known_) faults_.add(fault, file_.place(offset) + ": " + why);
  }

  void begin_chunk(std::uint64_t offset) { is_known_ = !chunks_.insert(offset).second; }
  void end_chunk() { is_known_ = false; }

  [[nodiscard]] const BagReport& faults() const { return faults_; }

 private:
  const RandomAccessFile& file_;
  BagReport faults_;
  std::set<std::uint64_t> chunks_;
  bool is_known_ = false;
};

}  // namespace km
