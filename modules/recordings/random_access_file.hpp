#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace km {

/// A file that is read at any position. Not thread-safe.
class RandomAccessFile {
 public:
  /// Throws InputFileError if there is no regular file to read.
  explicit RandomAccessFile(const std::filesystem::path& path);
  ~RandomAccessFile();
  RandomAccessFile(const RandomAccessFile&) = delete;
  RandomAccessFile& operator=(const RandomAccessFile&) = delete;

  /// [bytes], as the file was when opened.
  [[nodiscard]] std::uint64_t size() const { return size_; }

  /// True if [offset, offset + size) is within the file.
  [[nodiscard]] bool has(std::uint64_t offset, std::uint64_t size) const {
    return offset <= size_ && size <= size_ - offset;
  }

  /// The bytes [offset, offset + size), which the file must have. Throws InputFileError if they
  /// cannot be read.
  [[nodiscard]] std::vector<std::uint8_t> read(std::uint64_t offset, std::uint64_t size) const;

  /// "FILE byte OFFSET", as messages name a place.
  [[nodiscard]] std::string place(std::uint64_t offset) const;

 private:
  std::filesystem::path path_;
  int descriptor_ = -1;
  std::uint64_t size_ = 0;
};

}  // namespace km
