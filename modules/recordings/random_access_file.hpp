#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace km {

/// A file that is read at any position. Not thread-safe.
class RandomAccessFile {
 public:
  /// Throws InputFileError if `path` is no readable regular file.
  explicit RandomAccessFile(const std::filesystem::path& path);
  ~RandomAccessFile();
  RandomAccessFile(const RandomAccessFile&) = delete;
  RandomAccessFile& operator=(const RandomAccessFile&) = delete;

  /// Size of the file when it was opened [bytes].
  [[nodiscard]] std::uint64_t size() const { return size_; }

  /// True if [offset, offset + size) is within the file.
  [[nodiscard]] bool has(std::uint64_t offset, std::uint64_t size) const {
    return offset <= size_ && size <= size_ - offset;
  }

  /// The bytes [offset, offset + size). Throws InputFileError if they cannot be read. Precondition:
  /// has(offset, size).
  [[nodiscard]] std::vector<std::uint8_t> read(std::uint64_t offset, std::uint64_t size) const;

  /// The first `size` bytes as text; all of a shorter file.
  [[nodiscard]] std::string beginning(std::uint64_t size) const;

  /// Position for messages: "FILE byte OFFSET".
  [[nodiscard]] std::string place(std::uint64_t offset) const;

 private:
  std::filesystem::path path_;
  int descriptor_ = -1;
  std::uint64_t size_ = 0;
};

}  // namespace km
