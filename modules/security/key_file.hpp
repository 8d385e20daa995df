#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "modules/security/key_types.hpp"

namespace km {

/// Users who may read a file of keys.
enum class KeyFileAccess { kEveryone, kOwner };

/// A text file of keys or certificates: lines "name: value", and comments that begin with '#'. Its
/// first line with content states its format ("format: kimera_multi certificate 1"). Errors throw
/// std::runtime_error that names the file, the line, the value and the remedy.
class KeyFile {
 public:
  struct Line {
    int number = 0;  ///< Counted from 1.
    std::string name;
    std::string value;
  };

  /// Reads a file of `format`. With KeyFileAccess::kOwner, refuses a file that other users may read
  /// or write.
  static KeyFile read(const std::filesystem::path& file, std::string_view format,
                      KeyFileAccess access);

  /// The next line, which must have this name. Files are read from top to bottom.
  [[nodiscard]] const Line& next(std::string_view name);

  /// True if the next line has this name.
  [[nodiscard]] bool next_is(std::string_view name) const;

  /// Throws if there is a line left.
  void finish() const;

  [[noreturn]] void refuse(const Line& line, const std::string& why) const;

  /// Value of a line as hexadecimal bytes, a number, or a time.
  template <std::size_t N>
  [[nodiscard]] std::array<std::uint8_t, N> octets(const Line& line) const {
    std::array<std::uint8_t, N> value;
    read_hex(line, line.value, value.data(), N);
    return value;
  }
  [[nodiscard]] Secret<32> secret(const Line& line) const;
  [[nodiscard]] std::uint64_t number(const Line& line, std::uint64_t max) const;
  [[nodiscard]] std::int64_t time_s(const Line& line) const;

  /// Reads `text`, the value of `line` or a part of it, as `size` hexadecimal bytes into `octets`.
  void read_hex(const Line& line, std::string_view text, std::uint8_t* octets,
                std::size_t size) const;

 private:
  std::filesystem::path file_;
  std::vector<Line> lines_;
  std::size_t at_ = 0;
};

/// Replaces a file atomically: a crash leaves the former or the new file. Throws std::runtime_error
/// that names it.
void write_key_file(const std::filesystem::path& file, const std::string& text,
                    KeyFileAccess access);

[[nodiscard]] std::string to_hex(OctetView octets);

/// [s since 1970-01-01 UTC] as "2026-11-21T12:44:29Z".
[[nodiscard]] std::string time_text(std::int64_t time_s);

}  // namespace km
