#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <stdexcept>
#include <string_view>

namespace km {

/// A file of a recording that cannot be written. what() names the file and the reason.
struct RecordingError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Writes `bytes` under a temporary name beside `file` and renames it: a file that exists is whole,
/// whenever the program is stopped. Folders are made where missing. Throws RecordingError, after
/// which neither a new `file` nor the temporary one is there.
void write_whole_file(const std::filesystem::path& file, std::span<const std::uint8_t> bytes);
void write_whole_file(const std::filesystem::path& file, std::string_view text);

/// True for a PNG or JPEG file that exists and has its end marker: the name alone does not tell
/// when the machine, not the program, was stopped.
[[nodiscard]] bool is_whole_image(const std::filesystem::path& file);

}  // namespace km
