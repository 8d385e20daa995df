#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>

namespace km {

/// Room on the disk for a result that is written at the end of the run. A file of that size keeps
/// the room, and is removed just before the result is written.
class ReservedRoom {
 public:
  /// Removes a file that a killed process has left.
  explicit ReservedRoom(std::filesystem::path file);
  ~ReservedRoom() { release(); }
  ReservedRoom(const ReservedRoom&) = delete;
  ReservedRoom& operator=(const ReservedRoom&) = delete;

  /// If the disk is full, the room that is already reserved stays, and a warning names the bytes.
  void reserve(std::uint64_t bytes);
  void release() noexcept;

 private:
  const std::filesystem::path file_;
  std::uint64_t reserved_bytes_ = 0;
};

/// Room for the results that matter most: trajectories and summary.
class FinalRoom {
 public:
  /// `images`: number of images of the recording, 0 if unknown.
  FinalRoom(const std::filesystem::path& output, std::size_t images);

  /// Reserves room for the poses of these numbers of images and keyframes.
  void grow(std::size_t images, std::size_t keyframes);
  void release_trajectories() { trajectories_.release(); }
  void release_summary() { summary_.release(); }

 private:
  ReservedRoom trajectories_, summary_;
};

}  // namespace km
