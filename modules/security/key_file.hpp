#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "modules/security/key_types.hpp"

namespace km {

/// Who may read a file of keys.
enum class KeyFileAccess { kEveryone, kOwner };

/// A text file of keys or certificates: lines "name: value", and comments that begin with '#'. Its
/// first line with content says what it is ("format: kimera_multi certificate 1"). What is wrong
/// throws std::runtime_error that names the file, the line, the value and the way out.
class KeyFile {
 public:
  struct Line {
    int number = 0;  ///< Counted from 1.
    std::string name;
    std::string value;
  };

  /// Reads a file of `format`. One for its owner is refused if anyone else may read or write it.
  static KeyFile read(const std::filesystem::path& file, std::string_view format,
                      KeyFileAccess access);

  /// The next line, which must have this name. Files are read from top to bottom.
  [[nodiscard]] const Line& next(std::string_view name);

  /// True if the next line has this name.
  [[nodiscard]] bool next_is(std::string_view name) const;

  /// Throws if there is a line left.
  void finish() const;

  [[noreturn]] void refuse(const Line& line, const std::string& why) const;

  /// The value of a line as hexadecimal octets, a number, or a time.
  template <std::size_t N>
  [[nodiscard]] std::array<std::uint8_t, N> octets(const Line& line) const {
    std::array<std::uint8_t, N> value;
    read_hex(line, line.value, value.data(), N);
    return value;
  }
  [[nodiscard]] Secret<32> secret(const Line& line) const;
  [[nodiscard]] std::uint64_t number(const Line& line, std::uint64_t max) const;
  [[nodiscard]] std::int64_t time_s(const Line& line) const;

  /// Octets that are a part of the value of a line.
  void read_hex(const Line& line, std::string_view text, std::uint8_t* octets,
                std::size_t size) const;

 private:
  std::filesystem::path file_;
  std::vector<Line> lines_;
  std::size_t at_ = 0;
};

/// Writes a file in one step: there is the former one or the new one, never a part. Throws
/// std::runtime_error that names it.
void write_key_file(const std::filesystem::path& file, const std::string& text,
                    KeyFileAccess access);

[[nodiscard]] std::string to_hex(OctetView octets);

/// [s since 1970-01-01 UTC] as "2026-11-21T12:44:29Z".
[[nodiscard]] std::string time_text(std::int64_t time_s);

}  // namespace km
