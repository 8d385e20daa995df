#pragma once

#include <cstdint>
#include <filesystem>

namespace km {

/// Room on the disk for a result that is written at the end of the run. A file of that size keeps
/// the room, and is removed just before the result is written. Not thread-safe.
class ReservedRoom {
 public:
  /// Nothing is reserved yet. A file that a killed process has left is removed.
  explicit ReservedRoom(std::filesystem::path file);
  ~ReservedRoom() { release(); }
  ReservedRoom(const ReservedRoom&) = delete;
  ReservedRoom& operator=(const ReservedRoom&) = delete;

  /// Reserves at least `bytes`. If the disk is full, the room that is already reserved stays, and a
  /// warning names the bytes.
  void reserve(std::uint64_t bytes);

  /// Removes the file.
  void release() noexcept;

 private:
  const std::filesystem::path file_;
  std::uint64_t reserved_bytes_ = 0;
};

}  // namespace km
